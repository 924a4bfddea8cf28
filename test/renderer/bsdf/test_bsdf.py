"""The scattering model against what must hold: conserved energy, reciprocity, densities that match draws, Fresnel's and Snell's laws."""

import numpy as np
import pytest
from box_room import quad, scene
from numba import njit
from white_surfaces import WHITE

from renderer.bsdf import microfacet, reflectance
from renderer.bsdf.albedo import Albedos
from renderer.bsdf.albedo import fresnel_dielectric as fresnel_numpy
from renderer.bsdf.bsdf import evaluate_bsdf, sample_bsdf
from renderer.bsdf.layers import build_lobes
from renderer.core import lanes as ln
from renderer.core import sampling
from renderer.core.kernel import from_python
from renderer.path.surface_tables import build_surfaces

sample_cosine_hemisphere = from_python(sampling.sample_cosine_hemisphere)
sample_ggx_wm = from_python(microfacet.sample_ggx_wm)
fresnel_dielectric = from_python(microfacet.fresnel_dielectric)
fresnel_thin_dielectric = from_python(microfacet.fresnel_thin_dielectric)
reflected_share = from_python(reflectance.reflected_share)
whole_reflector = from_python(reflectance.whole_reflector)
diffuse_reflector = from_python(reflectance.diffuse_reflector)
cos_sin_two_pi = from_python(sampling.cos_sin_two_pi)

DIFFUSE = {"BASE_R": 1.0, "BASE_G": 1.0, "BASE_B": 1.0, "ROUGHNESS": 0.5, "IOR": 1.5, "COAT_ROUGHNESS": 0.1, "COS_FRONT": 1.0, "HIT": 1.0}
COSINES = (0.02, 0.1, 0.3, 0.6, 0.9, 1.0)


def albedos() -> Albedos:
    return build_surfaces(scene(quad((0, 0, 0), (1, 0, 0), (0, 1, 0), transmission=1.0, ior=1.5))).albedos


def lanes(**look: float) -> np.ndarray:
    memory = np.zeros(ln.LANES_SIZE, np.float32)
    for name, value in (DIFFUSE | look).items():
        memory[getattr(ln, name)] = value
    return memory


@njit
def scatter(lane, table, wo, numbers):
    """Rows (direction, rgb, density) of draws; zeros where a draw fails."""
    lane[ln.WO_X], lane[ln.WO_Y], lane[ln.WO_Z] = wo[0], wo[1], wo[2]
    kinds = build_lobes(lane, table)
    rows = np.zeros((len(numbers), 7), np.float32)
    for i in range(len(numbers)):
        lane[ln.U_LOBE], lane[ln.U_BSDF_0], lane[ln.U_BSDF_1] = numbers[i, 0], numbers[i, 1], numbers[i, 2]
        sample_bsdf(lane, kinds)
        evaluate_bsdf(lane, kinds, table.reflected)
        if lane[ln.WI_Z] != 0.0 and lane[ln.PDF] > 0.0:
            rows[i] = found(lane)
    return rows


@njit
def look_at(lane, table, wo, ways):
    """Rows (rgb, density) of given directions."""
    lane[ln.WO_X], lane[ln.WO_Y], lane[ln.WO_Z] = wo[0], wo[1], wo[2]
    kinds = build_lobes(lane, table)
    rows = np.zeros((len(ways), 4), np.float32)
    for i in range(len(ways)):
        lane[ln.WI_X], lane[ln.WI_Y], lane[ln.WI_Z] = ways[i, 0], ways[i, 1], ways[i, 2]
        evaluate_bsdf(lane, kinds, table.reflected)
        rows[i] = found(lane)[3:]
    return rows


@njit
def found(lane):
    x, y, z = lane[ln.WI_X], lane[ln.WI_Y], lane[ln.WI_Z]
    return np.array([x, y, z, lane[ln.F_COS_R], lane[ln.F_COS_G], lane[ln.F_COS_B], lane[ln.PDF]], np.float32)


def viewer(cosine: float) -> np.ndarray:
    return np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine], np.float32)


def numbers(count: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random((count, 3), dtype=np.float32)


def albedo(look, cosine, count=2**16):
    rows = scatter(lanes(**look), albedos(), viewer(cosine), numbers(count))
    density = np.where(rows[:, 6:] > 0, rows[:, 6:], 1)
    return (rows[:, 3:6].astype(np.float64) / density).mean(axis=0)


@pytest.mark.parametrize("name", WHITE)
def test_white_surfaces_return_all_light(name):
    for cosine in COSINES:
        np.testing.assert_allclose(albedo(WHITE[name], cosine), 1.0, atol=5e-3)


@pytest.mark.parametrize("name", ["lambert", "gloss", "cloth"])
def test_white_sheets_return_all_light_to_their_two_sides(name):
    look = WHITE[name] | {"DIFFUSE_TRANSMISSION": 0.6}
    for cosine in COSINES:
        np.testing.assert_allclose(albedo(look, cosine) + albedo(look | {"BEHIND": 1.0}, cosine), 1.0, atol=5e-3)


def test_a_sheet_lets_light_through_as_well_from_either_side():
    """The value for (wo, wi) with wi beyond equals that for the two exchanged: reciprocity through the sheet."""
    look = {"DIFFUSE_TRANSMISSION": 0.6, "BEHIND": 1.0, "BASE_R": 0.8}
    a, b = viewer(0.2), viewer(0.9)
    forth = look_at(lanes(**look), albedos(), a, b[None])[0, :3] / b[2]
    back = look_at(lanes(**look), albedos(), b, a[None])[0, :3] / a[2]
    np.testing.assert_allclose(forth, back, rtol=2e-3)


@pytest.mark.parametrize("name", WHITE)
@pytest.mark.parametrize("color", [0.0, 0.3, 0.8])
def test_no_surface_gains_light(name, color):
    look = WHITE[name] | {"BASE_R": color, "BASE_G": color, "BASE_B": color}
    for cosine in COSINES:
        assert (albedo(look, cosine, 2**13) < 1.01).all()


@pytest.mark.parametrize("name", ["lambert", "gloss", "lacquer", "steel", "rough metal", "half metal", "milky glass"])
def test_reflection_is_reciprocal(name):
    """Layers that scale what is under them by the viewer's side alone, coat, sheen and rough glass, are not; the rest is."""
    look = WHITE[name] | {"BASE_G": 0.3, "BASE_B": 0.6} | ({"ROUGHNESS": 0.0} if name == "milky glass" else {})
    rng = np.random.default_rng(3)
    for _ in range(60):
        a, b = (way / np.linalg.norm(way) for way in rng.normal(size=(2, 3)).astype(np.float32))
        a[2], b[2] = abs(a[2]), abs(b[2])
        forth = look_at(lanes(**look), albedos(), a, b[None])[0, :3] / b[2]
        back = look_at(lanes(**look), albedos(), b, a[None])[0, :3] / a[2]
        np.testing.assert_allclose(forth, back, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("name", ["lambert", "gloss", "steel", "rough metal", "coated", "cloth", "frosted", "inside frosted"])
@pytest.mark.parametrize("cosine", [0.25, 0.9])
def test_draws_follow_their_density(name, cosine):
    """Chi-square over cells of the sphere, equal in height and angle; the density is integrated over each cell."""
    count, heights, turns, fine = 40000, 20, 16, 24
    look = WHITE[name] | {"COAT_ROUGHNESS": 0.5}
    rows = scatter(lanes(**look), albedos(), viewer(cosine), numbers(count, 7))
    sampled = rows[rows[:, 6] > 0]
    angle = np.arctan2(sampled[:, 1], sampled[:, 0]) % (2 * np.pi)
    counts = np.histogram2d(sampled[:, 2], angle, bins=[heights, turns], range=[[-1, 1], [0, 2 * np.pi]])[0]
    z = -1 + 2 * (np.arange(heights * fine) + 0.5) / (heights * fine)
    turn = 2 * np.pi * (np.arange(turns * fine) + 0.5) / (turns * fine)
    zz, tt = np.meshgrid(z, turn, indexing="ij")
    flat = np.sqrt(1 - zz**2)
    ways = np.stack([flat * np.cos(tt), flat * np.sin(tt), zz], axis=-1).reshape(-1, 3).astype(np.float32)
    density = look_at(lanes(**look), albedos(), viewer(cosine), ways)[:, 3].astype(np.float64)
    cells = density.reshape(heights, fine, turns, fine).mean(axis=(1, 3)) * (4 * np.pi / (heights * turns)) * count
    big = cells > 8
    chi = ((counts[big] - cells[big]) ** 2 / cells[big]).sum()
    assert chi < big.sum() + 5 * np.sqrt(2 * big.sum())
    assert abs(counts[~big].sum() - cells[~big].sum()) < 5 * np.sqrt(cells[~big].sum() + 5)


def test_fresnel_at_normal_incidence_and_total_reflection():
    one = np.float32(1)
    for ior in (1.2, 1.5, 2.4):
        assert fresnel_dielectric(one, np.float32(ior)) == pytest.approx(((ior - 1) / (ior + 1)) ** 2, rel=1e-4)
    critical = np.sqrt(1 - 1 / 1.5**2)
    assert fresnel_dielectric(np.float32(critical - 0.01), np.float32(1 / 1.5)) == 1.0
    assert fresnel_dielectric(np.float32(critical + 0.01), np.float32(1 / 1.5)) < 1.0
    for cosine in (0.01, 0.3, 0.9):
        assert fresnel_dielectric(np.float32(cosine), np.float32(1.5)) == pytest.approx(
            float(fresnel_numpy(np.array(cosine), 1.5)), rel=1e-4
        )
        once = fresnel_dielectric(np.float32(cosine), np.float32(1.5))
        assert fresnel_thin_dielectric(np.float32(cosine), np.float32(1.5)) == pytest.approx(2 * once / (1 + once), rel=1e-5)


def test_smooth_metal_mirrors_and_smooth_glass_bends_by_snell():
    wo = viewer(0.6)
    rows = scatter(lanes(METALLIC=1.0, ROUGHNESS=0.0), albedos(), wo, numbers(500))
    rows = rows[rows[:, 6] > 0]
    assert np.percentile(np.abs(rows[:, :3] - [-wo[0], 0, wo[2]]).max(axis=1), 90) < 0.01
    rows = scatter(lanes(TRANSMISSION=1.0, ROUGHNESS=0.0), albedos(), wo, numbers(4000))
    below = rows[rows[:, 2] < 0]
    sine = 0.8 / 1.5
    np.testing.assert_allclose(np.median(below[:, :3], axis=0), [-sine, 0, -np.sqrt(1 - sine**2)], atol=2e-3)
    assert len(below) / 4000 == pytest.approx(1 - float(fresnel_dielectric(np.float32(0.6), np.float32(1.5))), abs=0.02)


def test_black_and_empty_surfaces_do_not_scatter():
    rows = scatter(lanes(BASE_R=0, BASE_G=0, BASE_B=0, IOR=1.0), albedos(), viewer(0.5), numbers(100))
    assert np.isfinite(rows).all() and (rows[:, 3:6] == 0).all()


def test_directions_are_unit():
    for u, v, _ in numbers(300):
        for way in (sample_cosine_hemisphere(u, v), sample_ggx_wm(*viewer(0.3), np.float32(0.4), u, v)):
            assert np.linalg.norm(way) == pytest.approx(1.0, abs=1e-5)
        np.testing.assert_allclose(cos_sin_two_pi(u), (np.cos(2 * np.pi * u), np.sin(2 * np.pi * u)), atol=2e-6)


@njit
def arriving_albedo(lane, table, wi, views):
    """The share of light from one direction that is reflected to all sides, (3,)."""
    lane[ln.WI_X], lane[ln.WI_Y], lane[ln.WI_Z] = wi[0], wi[1], wi[2]
    total = np.zeros(3, np.float64)
    for i in range(len(views)):
        lane[ln.WO_X], lane[ln.WO_Y], lane[ln.WO_Z] = views[i, 0], views[i, 1], views[i, 2]
        evaluate_bsdf(lane, build_lobes(lane, table), table.reflected)
        total += np.pi / len(views) / wi[2] * found(lane)[3:6]
    return total


@pytest.mark.parametrize(("coat", "within"), [(0.0, 0.02), (0.7, 0.04)], ids=["uncoated", "coated"])
@pytest.mark.parametrize(("base", "roughness"), [(0.1, 0.4), (0.7, 0.6)])
def test_light_counts_by_what_is_reflected_of_its_direction(coat, within, base, roughness):
    """What a coat takes from the layers under it is taken for the same on all their ways out."""
    table = albedos()
    look = lanes(BASE_R=base, BASE_G=base, BASE_B=base, ROUGHNESS=roughness, COAT=coat, COAT_ROUGHNESS=0.5)
    u = (np.arange(1024) + 0.5) / 1024
    v, turn = (axis.ravel() for axis in np.meshgrid(u, 2.0 * np.pi * u[::4]))
    views = np.stack([np.cos(turn) * np.sqrt(1.0 - v), np.sin(turn) * np.sqrt(1.0 - v), np.sqrt(v)], axis=1)
    base, ior, roughness, coat, coat_roughness = (np.float32(x) for x in (base, 1.5, roughness, coat, 0.5))
    whole = whole_reflector(base, ior, roughness, coat, coat_roughness, table.reflected)
    for cosine in (0.1, 0.3, 0.9):
        expected = arriving_albedo(look, table, viewer(cosine), views.astype(np.float32))[0]
        assert reflected_share(whole, np.float32(cosine), table.reflected) / whole.per_mean == pytest.approx(expected, rel=within)
    for reflector in (whole, diffuse_reflector(ior, roughness, table.reflected)):
        shares = [reflected_share(reflector, np.float32(np.sqrt(v)), table.reflected) for v in u]
        assert np.mean(shares) == pytest.approx(1.0, abs=5e-3)
