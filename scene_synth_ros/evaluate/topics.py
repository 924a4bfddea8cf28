"""Which topics of bags hold the truth, the estimates and an algorithm's images of each task."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from scene_synth_ros.evaluate.algorithm import layer_of
from scene_synth_ros.evaluate.errors import EvaluateError
from scene_synth_ros.evaluate.readings import READERS
from scene_synth_ros.evaluate.task_streams import TASK_STREAMS, TRUTH_STREAMS
from scene_synth_ros.messages.streams import IMAGE_FORMS, INFO, RAW, TRANSPORTS, Stream, find_images, find_streams, parse


class TypedTopic(NamedTuple):
    """A topic and the type of its messages; of transforms the name ends in ``@`` and the frame that is meant."""

    name: str
    type_name: str

    @property
    def in_bag(self) -> str:
        """The name as bags have it."""
        return self.name.partition("@")[0]


def parse_mapping(words: Sequence[str]) -> dict[str, str]:
    """Return task -> topic of words ``TASK:=TOPIC``; tasks that judge the same messages have the same topic, unless they have their own.

    Raises:
        EvaluateError: a word has another form, or names no task.
    """
    found = {}
    for word in words:
        task, separator, topic = word.partition(":=")
        if not separator or not topic.startswith("/"):
            raise EvaluateError(f"--topic {word}: expected TASK:=/TOPIC, for example depth:=/my/depth")
        if task not in TASK_STREAMS:
            raise EvaluateError(f"--topic {word}: expected a task of {', '.join(TASK_STREAMS)}, got '{task}'")
        found[task] = topic
    return found | {task: found[row.name] for task, row in TASK_STREAMS.items() if task not in found and row.name in found}


def truth_topics(types: Mapping[str, str], layers: Sequence[str], camera: str, where: str) -> dict[str, TypedTopic]:
    """Return layer -> topic of its truth, all of one camera.

    ``camera``: its name alone or with its namespace; empty takes the only one, or the first that has all that is asked for.

    Raises:
        EvaluateError: no camera has the truth of a layer.
    """
    by_camera: dict[str, dict[str, TypedTopic]] = {}
    for layer in layers:
        for stream, topic in _truths(types, layer).items():
            if not camera or stream.is_of(camera):
                by_camera.setdefault(stream.base, {})[layer] = topic
    best = max(sorted(by_camera), key=lambda base: len(by_camera[base]), default="")
    found = by_camera.get(best, {})
    lacking = [layer for layer in layers if layer not in found]
    if lacking:
        expected = " and ".join(TASK_STREAMS[layer].truth(best or "<camera>").topic for layer in lacking)
        of = f" of camera '{camera}'" if camera else ""
        raise EvaluateError(f"{where}: expected truth of {', '.join(lacking)}{of} on {expected}, got {_named(types)}; record that stream")
    return found


def layers_present(types: Mapping[str, str], camera: str, layers: Sequence[str]) -> dict[str, TypedTopic]:
    """Return layer -> topic of its truth, of those that a camera has."""
    found = {layer: _truths(types, layer).get(TRUTH_STREAMS[layer].truth(camera)) for layer in layers}
    return {layer: topic for layer, topic in found.items() if topic is not None}


def camera_of(topics: Mapping[str, TypedTopic]) -> str:
    """Return the camera of a truth's layers, with its namespace."""
    stream = parse(next(iter(topics.values())).name)
    assert stream is not None
    return stream.base


def estimate_topic(
    types: Mapping[str, str], task: str, chosen: str, truth: TypedTopic, camera: str, where: str, *, same_bag: bool
) -> TypedTopic:
    """Return the topic of a task's estimates.

    Without a choice it is, of a bag of estimates, the default name of the task, then the truth's own name, then the only topic of a type
    that fits; of the truth's bag the default name, then what a modelled sensor has read.

    Raises:
        EvaluateError: there is none, or there are several, or it is of a type that is not taken.
    """
    stream = TASK_STREAMS[task]
    own = stream.own._replace(base=camera).topic if stream.own else ""
    names = [chosen] if chosen else [stream.estimate, own] if same_bag else [stream.estimate, truth.name]
    for name in names:
        for transport in TRANSPORTS:
            kind = types.get(f"{name.partition('@')[0]}{transport}")
            if kind is not None and kind not in stream.types:
                expected = " or ".join(stream.types)
                raise EvaluateError(f"{where}: topic {name}: expected {expected} as estimates of {task}, got {kind}; choose another topic")
            if kind is not None:
                return TypedTopic(f"{name}{transport}", kind)
    fitting = [] if chosen or same_bag else [name for name, kind in sorted(types.items()) if kind in stream.types]
    if len(fitting) == 1:
        return TypedTopic(fitting[0], types[fitting[0]])
    got = f"topics {', '.join(fitting)} that could be" if fitting else _named(types)
    advice = "check the name" if chosen else f"name it: --topic {task}:=/TOPIC"
    raise EvaluateError(f"{where}: expected estimates of {task} on {names[0]}, got {got}; {advice}")


def image_topics(types: Mapping[str, str], camera: str, names: Sequence[str], where: str) -> dict[str, TypedTopic]:
    """Return layer -> topic of the images that an algorithm asks for.

    ``names`` are layers of the truth's camera, ``color``, or of another, ``right/color``; ``color@next`` is on the topic of ``color``.

    Raises:
        EvaluateError: the bag lacks one.
    """
    found, images = {}, find_images(types)
    for name in names:
        other, _, layer = layer_of(name).rpartition("/")
        base = f"{camera.rpartition('/')[0]}/{other}" if other else camera
        raw = Stream(base, RAW, layer).topic
        topic = images.get(Stream(base, RAW, layer))
        if topic is None:
            raise EvaluateError(f"{where}: expected images '{name}' for the algorithm on {raw}, got {_named(types)}; record that stream")
        found[name] = TypedTopic(topic, types[topic])
    return found


def info_topics(types: Mapping[str, str], images: Mapping[str, TypedTopic]) -> dict[str, TypedTopic]:
    """Return layer -> topic of the camera infos beside images, of those that have one."""
    streams = {name: parse(topic.name) for name, topic in images.items()}
    infos = {name: stream.beside(INFO).topic for name, stream in streams.items() if stream is not None and stream.role in IMAGE_FORMS}
    return {name: TypedTopic(info, INFO.type_name) for name, info in infos.items() if types.get(info) == INFO.type_name}


def _truths(types: Mapping[str, str], layer: str) -> dict[Stream, TypedTopic]:
    """Return the truths of a layer, of every camera -> topic, of the first form that each has."""
    row = TRUTH_STREAMS[layer]
    topics = find_images(types) if row.role is RAW else {stream: topic for topic, stream in find_streams(types, row.role).items()}
    return {stream: TypedTopic(topic, types[topic]) for stream, topic in topics.items() if stream.layer == row.layer}


def _named(types: Mapping[str, str]) -> str:
    """Return the topics that could be meant, in a few words."""
    names = sorted(name for name, kind in types.items() if kind in READERS)
    return (", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")) if names else "no such topic"
