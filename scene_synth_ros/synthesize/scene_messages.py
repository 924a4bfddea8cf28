"""A room as messages: what the grammar node publishes of it, and what begins its part of a bag.  No node here."""

from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from grammar.synthesize import FloorMap
from scene_description import SceneDescription
from scene_synth_ros.messages import streams
from scene_synth_ros.messages.conversions import occupancy_to_msg, scene_to_markers
from scene_synth_ros.messages.streams import Stream

SCENE, MARKERS, MAP = Stream("", streams.SCENE).topic, Stream("scene", streams.MARKERS).topic, Stream("scene", streams.MAP).topic
SCENE_TOPICS: dict[str, type] = {SCENE: String, MARKERS: MarkerArray, MAP: OccupancyGrid}
"""Topics below the namespace, all latched."""


def scene_to_msgs(scene: SceneDescription, text: str, floor: FloorMap, world_frame: str) -> dict[str, object]:
    """Return topic -> message, in the order in which they are published: the description last, when all else is there."""
    stamp_ns = scene.camera_path[0].stamp_ns
    return {
        MAP: occupancy_to_msg(floor.cells, floor.resolution_m, floor.origin_m, stamp_ns, world_frame),
        MARKERS: scene_to_markers(scene, stamp_ns, world_frame),
        SCENE: String(data=text),
    }
