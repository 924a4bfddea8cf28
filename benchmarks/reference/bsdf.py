"""Our opaque BSDF written a second time, as a plugin of Mitsuba's: coat and sheen over metal or a specular and diffuse base.

After the papers that :mod:`renderer.bsdf.bsdf` names, in Mitsuba's own distributions; of ours only the tables of albedos, which the
furnace tests hold.  Directions are sampled from the diffuse, the specular and the coat's lobe in proportion to what they reflect.
"""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from renderer.bsdf.albedo import MIN_ALPHA, STEPS, reflected_table

COAT_F0 = 0.04


def _schlick(f0: Any, f90: Any, cosine: Any) -> Any:
    return f0 + (f90 - f0) * dr.power(dr.maximum(1.0 - cosine, 0.0), 5)


class _Albedo:
    """Albedo of microfacets of one roughness by the viewer's cosine: at reflectance 1, and its part by Schlick's weight."""

    def __init__(self, roughness: float) -> None:
        table = reflected_table().astype(np.float64)
        y = max(roughness, np.sqrt(MIN_ALPHA)) * (STEPS - 1)
        low = min(int(y), STEPS - 2)
        row = (low + 1 - y) * table[low] + (y - low) * table[low + 1]
        self.e, self.e_schlick, self.sheen = (mi.Float(row[:STEPS, kind].astype(np.float32)) for kind in range(3))
        self.mean, self.mean_schlick = float(row[STEPS, 0]), float(row[STEPS, 1])

    def at(self, column: Any, cosine: Any) -> Any:
        x = dr.sqrt(dr.clip(cosine, 0.0, 1.0)) * (STEPS - 1)
        low = dr.minimum(mi.UInt32(x), STEPS - 2)
        share = x - mi.Float(low)
        return dr.lerp(dr.gather(mi.Float, column, low), dr.gather(mi.Float, column, low + 1), share)


class Layered(mi.BSDF):  # type: ignore[misc]
    """The plugin ``layered``: red, green, blue, ior, roughness, metallic, clearcoat, clearcoat_roughness, sheen, all numbers."""

    def __init__(self, properties: Any) -> None:
        super().__init__(properties)
        get = properties.get
        base = np.array([get("red"), get("green"), get("blue")])
        metal, ior, roughness, coat_roughness = get("metallic"), get("ior"), get("roughness"), get("clearcoat_roughness")
        f0 = ((ior - 1.0) / (ior + 1.0)) ** 2
        f90 = min(50.0 * f0, 1.0)
        self.albedo, self.coat_albedo = _Albedo(roughness), _Albedo(coat_roughness)
        mean = self.albedo.mean
        enters = 1.0 - (f0 * (mean - self.albedo.mean_schlick) + f90 * self.albedo.mean_schlick)
        average = base + (1.0 - base) / 21.0
        again = average**2 * mean / (1.0 - average * (1.0 - mean))
        numbers = {
            "f0": f0,
            "f90": f90,
            "opaque": 1.0 - metal,
            "metal": metal,
            "enters": enters,
            "lost": max(1.0 - mean, 1e-30),
            "coat": get("clearcoat"),
            "sheen_weight": get("sheen"),
            "alpha": max(roughness**2, MIN_ALPHA),
            "coat_alpha": max(coat_roughness**2, MIN_ALPHA),
        }
        for name, value in numbers.items():
            setattr(self, name, dr.opaque(mi.Float, value))
        self.base, self.again = (mi.Color3f(*(dr.opaque(mi.Float, float(c)) for c in color)) for color in (base, again))
        reflection = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components, self.m_flags = [reflection], reflection

    def _lobes(self, cosine: Any) -> tuple[Any, ...]:
        """Return what coat and sheen leave, albedos of coat and microfacets, probabilities of the diffuse, specular and coat lobes."""
        e, e_schlick = self.albedo.at(self.albedo.e, cosine), self.albedo.at(self.albedo.e_schlick, cosine)
        e_coat, e_coat_schlick = (self.coat_albedo.at(table, cosine) for table in (self.coat_albedo.e, self.coat_albedo.e_schlick))
        coat = self.coat * (COAT_F0 * (e_coat - e_coat_schlick) + e_coat_schlick)
        sheen = self.albedo.at(self.albedo.sheen, cosine)
        under = (1.0 - coat) * (1.0 - self.sheen_weight * sheen)
        dielectric = self.f0 * (e - e_schlick) + self.f90 * e_schlick
        diffuse = under * (self.opaque * mi.luminance(self.base) * (1.0 - dielectric) + self.metal * mi.luminance(self.again) * (1.0 - e))
        diffuse += self.sheen_weight * (1.0 - coat) * sheen
        metal = mi.luminance(self.base) * (e - e_schlick) + e_schlick
        specular = under * (self.opaque * dielectric + self.metal * metal)
        scale = dr.rcp(dr.maximum(diffuse + specular + coat, 1e-30))
        return under, coat, e, dielectric, diffuse * scale, specular * scale, coat * scale

    def eval_pdf(self, context: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
        """Return the scattering function times the light's cosine, and the pdf of :meth:`sample`."""
        above = si.wi.z * wo.z > 0.0
        wi, wo = dr.mulsign(si.wi, si.wi.z), dr.mulsign(wo, wo.z)
        active = active & above & (wi.z > 0.0)
        half = dr.normalize(wi + wo)
        across = dr.dot(wi, half)
        under, coat_albedo, e, dielectric, pr_diffuse, pr_specular, pr_coat = self._lobes(wi.z)
        e_other, e_other_schlick = self.albedo.at(self.albedo.e, wo.z), self.albedo.at(self.albedo.e_schlick, wo.z)
        enters = 1.0 - (self.f0 * (e_other - e_other_schlick) + self.f90 * e_other_schlick)
        flat = wo.z * dr.inv_pi
        value = self.base * (under * self.opaque * (1.0 - dielectric) * enters / self.enters * flat)
        value += self.again * (under * self.metal * (1.0 - e) * (1.0 - e_other) / self.lost * flat)
        value += self.sheen_weight * (1.0 - coat_albedo) * dr.power(1.0 - across, 5) * wo.z
        pdf = pr_diffuse * flat
        facets, lobe_pdf = self._facets(self.alpha, wi, wo, half)
        fresnel = self.opaque * _schlick(self.f0, self.f90, across) + self.metal * _schlick(self.base, mi.Color3f(1.0), across)
        value += under * fresnel * facets
        pdf += pr_specular * lobe_pdf
        facets, lobe_pdf = self._facets(self.coat_alpha, wi, wo, half)
        value += self.coat * _schlick(COAT_F0, 1.0, across) * facets
        pdf += pr_coat * lobe_pdf
        return dr.select(active, value, 0.0), dr.select(active, pdf, 0.0)

    def _facets(self, alpha: Any, wi: Any, wo: Any, half: Any) -> tuple[Any, Any]:
        """Return GGX with Smith's masking of both directions together, without Fresnel's term, and the pdf of sampling it."""
        distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, True)
        first, second = distribution.smith_g1(wi, half), distribution.smith_g1(wo, half)
        both = first * second / dr.maximum(first + second - first * second, 1e-30)
        return (
            distribution.eval(half) * both / (4.0 * dr.maximum(wi.z, 1e-30)),
            distribution.pdf(wi, half) / (4.0 * dr.maximum(dr.dot(wi, half), 1e-30)),
        )

    def sample(self, context: Any, si: Any, lobe: Any, point: Any, active: Any = True) -> tuple[Any, Any]:
        """Sample a direction from the lobes."""
        wi = dr.mulsign(si.wi, si.wi.z)
        pr_diffuse, pr_specular = self._lobes(wi.z)[4:6]
        alpha = dr.select(lobe < pr_diffuse + pr_specular, self.alpha, self.coat_alpha)
        normal, _ = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, True).sample(wi, point)
        wo = dr.select(lobe < pr_diffuse, mi.warp.square_to_cosine_hemisphere(point), mi.reflect(wi, normal))
        active = active & (wo.z > 0.0) & (wi.z > 0.0)
        record = dr.zeros(mi.BSDFSample3f)
        record.wo = dr.mulsign(wo, si.wi.z)
        record.eta = 1.0
        record.sampled_component = mi.UInt32(0)
        record.sampled_type = mi.UInt32(+self.m_flags)
        value, record.pdf = self.eval_pdf(context, si, record.wo, active)
        active = active & (record.pdf > 0.0)
        return record, dr.select(active, value / record.pdf, 0.0)

    def eval(self, context: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """Return the first of :meth:`eval_pdf`."""
        return self.eval_pdf(context, si, wo, active)[0]

    def pdf(self, context: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """Return the second of :meth:`eval_pdf`."""
        return self.eval_pdf(context, si, wo, active)[1]

    def traverse(self, callback: Any) -> None:
        """Show nothing: e_other is nothing to differentiate."""

    def to_string(self) -> str:
        """Return the plugin's name."""
        return "layered"


def register() -> None:
    """Make the plugin known to Mitsuba."""
    mi.register_bsdf("layered", Layered)
