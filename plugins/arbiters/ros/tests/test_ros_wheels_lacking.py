"""The interfaces of ROS that its wheels lack: their fields, and that colcon ignores them."""

from pathlib import Path

from geographic_msgs.msg import GeoPath, GeoPoint, GeoPointStamped, GeoPoseStamped
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TF2Error, TFMessage

FOLDER = Path(__file__).parents[4] / "ros" / "wheels"


def test_fields_have_the_names_types_and_order_of_ros() -> None:
    assert TFMessage.get_fields_and_field_types() == {
        "transforms": "sequence<geometry_msgs/TransformStamped>"
    }
    assert list(LookupTransform.Goal.get_fields_and_field_types().items()) == [
        ("target_frame", "string"),
        ("source_frame", "string"),
        ("source_time", "builtin_interfaces/Time"),
        ("timeout", "builtin_interfaces/Duration"),
        ("target_time", "builtin_interfaces/Time"),
        ("fixed_frame", "string"),
        ("advanced", "boolean"),
    ]
    assert (TF2Error.LOOKUP_ERROR, TF2Error.TRANSFORM_ERROR) == (1, 6)
    assert list(GeoPoint.get_fields_and_field_types().items()) == [
        ("latitude", "double"),
        ("longitude", "double"),
        ("altitude", "double"),
    ]
    stamped = {"header": "std_msgs/Header", "position": "geographic_msgs/GeoPoint"}
    assert GeoPointStamped.get_fields_and_field_types() == stamped
    posed = {"header": "std_msgs/Header", "pose": "geographic_msgs/GeoPose"}
    assert GeoPoseStamped.get_fields_and_field_types() == posed
    assert list(GeoPath.get_fields_and_field_types()) == ["header", "poses"]


def test_a_workspace_of_ros_never_builds_them() -> None:
    assert (FOLDER / "COLCON_IGNORE").exists()
    assert sorted(each.parent.name for each in FOLDER.glob("*/package.xml")) == [
        "geographic_msgs",
        "tf2_msgs",
    ]
