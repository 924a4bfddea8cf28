"""Images as sensor_msgs/CompressedImage, in the forms that image_transport's plugins ``compressed`` and ``compressedDepth`` read.

``compressedDepth`` puts twelve bytes before the PNG: format (int32, 0 for inverse depth) and two float32 parameters A and B.  Depth in
metres is stored as ``A / depth + B`` in 16 bits, which loses some of it: a step of depth d is d^2 / A.  Depth in whole millimetres (16UC1)
is stored as it is.
"""

import struct
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CompressedImage, Image

from renderer.files.image_io import encode_image
from renderer.film.layers import LAYERS
from scene_description import Limits
from scene_synth_ros.messages.canonical_cdr import canonical_cdr
from scene_synth_ros.messages.conversions import ENCODING_CHANNELS, msg_to_image
from scene_synth_ros.messages.image_reader import CodecError
from scene_synth_ros.messages.streams import PICTURE, RAW, TRANSPORTS, Stream, parse


class DepthCoding(NamedTuple):
    """How depth becomes inverse depth, the parameters of image_transport's plugin: A = q (q + 1), B = 1 - A / max.

    The defaults resolve 1 mm at 3.2 m.
    """

    max_m: float = 60.0
    """Depth from here on is stored as unknown."""
    quantization: float = 100.0


_PLAIN = ("rgb8", "mono8", "16UC1")
_CODED = 2**16 - 1
_FIXED = "a bag has one form of each image"
_HEAD = struct.Struct("<iff")
_BAG_CODING = DepthCoding()


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageCompression:
    """How images are kept in bags."""

    color: Annotated[Literal["none", "png", "jpeg"], Limits(description="Colour and pictures for people", fixed=_FIXED)] = "none"
    ids: Annotated[Literal["none", "png"], Limits(description="Class and object ids (lossless)", fixed=_FIXED)] = "none"
    depth: Annotated[
        Literal["none", "png"], Limits(description="Depth: 16UC1 lossless, 32FC1 as inverse depth in 16 bits (lossy)", fixed=_FIXED)
    ] = "none"
    jpeg_quality: Annotated[int, Limits(ge=1, le=100, description="Quality of JPEG", fixed=_FIXED)] = 90


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveCompression:
    """How the compressed topics beside live images are made, for who subscribes to them."""

    ids: ClassVar[str] = "png"
    depth: ClassVar[str] = "png"
    color: Annotated[Literal["jpeg", "png"], Limits(description="Colour on image_raw/compressed")] = "jpeg"
    jpeg_quality: Annotated[int, Limits(ge=1, le=100, description="Quality of JPEG")] = 90
    depth_max_m: Annotated[
        float, Limits(ge=1.0, le=100.0, unit="m", description="32FC1 depth from here on is unknown on image_raw/compressedDepth")
    ] = DepthCoding().max_m
    depth_quantization: Annotated[
        float, Limits(ge=1.0, le=150.0, unit="m", description="32FC1 depth at which the step of compressedDepth is 1 m, nearly")
    ] = DepthCoding().quantization

    @property
    def depth_coding(self) -> DepthCoding:
        """The parameters of inverse depth."""
        return DepthCoding(self.depth_max_m, self.depth_quantization)


def image_form(topic: str, type_name: str, compression: ImageCompression | LiveCompression) -> str:
    """Return how a topic is kept: ``png``, ``jpeg`` or ``none``."""
    kind = _setting(parse(topic, type_name))
    return str(getattr(compression, kind)) if kind else "none"


def compressed_topic(topic: str) -> str:
    """Return the topic of a compressed image."""
    return f"{topic}{TRANSPORTS[2 if _setting(parse(topic)) == 'depth' else 1]}"


def _setting(stream: Stream | None) -> str:
    """Return which field of :class:`ImageCompression` holds for a stream, or nothing."""
    if stream is None or stream.role not in (RAW, PICTURE):
        return ""
    return "color" if stream.role is PICTURE else LAYERS[stream.layer].compression if stream.layer in LAYERS else ""


def compress(cdr: bytes, topic: str, form: str, quality: int) -> bytes:
    """Return the serialised CompressedImage of a serialised Image.

    The topic, where it was published, says whether it is depth; ``form`` is ``png`` or ``jpeg``.

    Raises:
        CodecError: the image's encoding has no such form.
    """
    image = deserialize_message(cdr, Image)
    if image.encoding not in ENCODING_CHANNELS:
        raise CodecError(f"{topic}: expected an encoding of {', '.join(ENCODING_CHANNELS)}, got '{image.encoding[:40]}'")
    return canonical_cdr(compress_image(image, msg_to_image(image), compressed_topic(topic), form, quality))


def compress_image(
    image: Image, pixels: NDArray[np.generic], topic: str, form: str, quality: int, coding: DepthCoding = _BAG_CODING
) -> CompressedImage:
    """Return the compressed form of an image for a compressed topic.

    The compressed topic says whether it is depth; ``form`` is ``png`` or ``jpeg``, ``coding`` that of depth in metres.

    Raises:
        CodecError: the image's encoding has no such form.
    """
    message = CompressedImage(header=image.header)
    if topic.endswith(TRANSPORTS[2]):
        message.format = f"{image.encoding}; compressedDepth png"
        data = _depth(pixels, image.encoding, topic, coding)
    elif image.encoding in _PLAIN and not (form == "jpeg" and image.encoding == "16UC1"):
        ordered = "bgr8" if image.encoding == "rgb8" else image.encoding  # what OpenCV, which wrote the plugin's files, calls them
        message.format = f"{image.encoding}; {form} compressed {ordered}"
        data = encode_image(pixels, form, quality=quality)  # type: ignore[arg-type]
    else:
        raise CodecError(f"{topic}: expected one of {', '.join(_PLAIN)} for {form}, got '{image.encoding[:40]}'")
    message.data.frombytes(data)
    return message


def _depth(pixels: NDArray[np.generic], encoding: str, topic: str, coding: DepthCoding) -> bytes:
    if encoding == "16UC1":
        return _HEAD.pack(0, 0.0, 0.0) + encode_image(pixels.astype(np.uint16), "png")
    if encoding != "32FC1":
        raise CodecError(f"{topic}: expected 16UC1 or 32FC1, got '{encoding[:40]}'")
    a = coding.quantization * (coding.quantization + 1.0)
    b = 1.0 - a / coding.max_m
    depth = pixels.astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = np.where((depth > 0.0) & (depth < coding.max_m), a / depth + b, 0.0)
    return _HEAD.pack(0, a, b) + encode_image(np.rint(np.clip(inverse, 0, _CODED)).astype(np.uint16), "png")
