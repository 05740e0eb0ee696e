"""The m2pem node of a vehicle, on board: `m2pem ros onboard`."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = [
    DeclareLaunchArgument("vehicle", description="The vehicle's name in the fleet."),
    DeclareLaunchArgument(
        "origin", description="Origin of the frame map, LAT,LON,ALT: that of the fleet."
    ),
    DeclareLaunchArgument("namespace", default_value="", description="Empty: / and its name."),
    DeclareLaunchArgument("driver", default_value="base", choices=["base", "nav2"]),
    DeclareLaunchArgument("domain", default_value="ground", choices=["ground", "surface"]),
    DeclareLaunchArgument("epochs", default_value="", description="File of epochs; empty: none."),
    DeclareLaunchArgument(
        "autostart",
        default_value="true",
        choices=["true", "false"],
        description="false: a lifecycle manager configures and activates the node.",
    ),
    DeclareLaunchArgument("params_file", default_value="", description="Parameters of the node."),
    DeclareLaunchArgument("use_sim_time", default_value="false", description="Follow /clock."),
    DeclareLaunchArgument("log_level", default_value="info", description="Of the node."),
]


def onboard(context: LaunchContext) -> list[Node]:
    """Return the process, which is one node."""
    given = {
        each.name: LaunchConfiguration(each.name).perform(context).strip() for each in ARGUMENTS
    }
    namespace = given["namespace"] or f"/{given['vehicle']}"
    words = ["ros", "onboard", "--vehicle", given["vehicle"], "--origin", given["origin"]]
    words += ["--namespace", namespace, "--driver", given["driver"], "--domain", given["domain"]]
    if given["epochs"]:
        words += ["--epochs", given["epochs"]]
    if given["autostart"] == "false":
        words += ["--no-autostart"]
    files = [given["params_file"]] if given["params_file"] else []
    return [
        Node(
            package="m2pem",
            executable="m2pem",
            name="m2pem_onboard",
            namespace=namespace,
            arguments=words,
            parameters=[*files, {"use_sim_time": given["use_sim_time"].lower() == "true"}],
            ros_arguments=["--log-level", given["log_level"]],
            output="screen",
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """Return what `ros2 launch m2pem onboard.launch.py vehicle:=NAME origin:=PLACE` starts."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=onboard)])
