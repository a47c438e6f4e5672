"""Starts the node, and RViz beside it when rviz:=true.

ros2 launch salient_stereo salient_stereo.launch.py namespace:=/stereo overlay:=road
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterFile, ParameterValue
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = {
    "namespace": ("/", "Namespace of the cameras' topics and of the node."),
    "overlay": ("salient_stereo", "Parameter file of this package: salient_stereo (defaults), road, indoor, low_power."),
    "left": ("left/image_rect", "Left image topic."),
    "right": ("right/image_rect", "Right image topic."),
    "left_info": ("left/camera_info", "Left camera info topic."),
    "right_info": ("right/camera_info", "Right camera info topic."),
    "image_transport": ("raw", "raw or compressed."),
    "use_sim_time": ("false", "Take the time from /clock."),
    "log_level": ("info", "debug, info, warn, error or fatal."),
    "rviz": ("false", "Start RViz too."),
}


def generate_launch_description():
    share = FindPackageShare("salient_stereo")
    value = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    overlay = ParameterFile([share, "/config/", value["overlay"], ".yaml"])
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    remappings = [
        ("left/image_rect", value["left"]),
        ("right/image_rect", value["right"]),
        ("left/camera_info", value["left_info"]),
        ("right/camera_info", value["right_info"]),
    ]
    node = Node(
        package="salient_stereo",
        executable="salient_stereo_node",
        name="salient_stereo",
        namespace=value["namespace"],
        parameters=[
            overlay,
            {
                "image_transport": value["image_transport"],
                "use_sim_time": ParameterValue(value["use_sim_time"], value_type=bool),
            },
        ],
        remappings=remappings,
        ros_arguments=["--log-level", value["log_level"]],
        output="screen",
    )
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        namespace=value["namespace"],
        arguments=["-d", PathJoinSubstitution([share, "rviz", "salient_stereo.rviz"])],
        condition=IfCondition(value["rviz"]),
    )
    return LaunchDescription([*arguments, node, rviz])
