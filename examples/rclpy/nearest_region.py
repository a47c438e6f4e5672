#!/usr/bin/env python3
"""Passes on the nearest region of each frame that can be trusted, on `nearest`.

python3 nearest_region.py --ros-args -r regions:=/stereo/regions -p min_confidence:=0.5
"""

import math

import rclpy
from rclpy.node import Node
from salient_stereo_msgs.msg import SalientRegionArray


def nearest(regions, min_confidence):
    """The region whose near side (5th percentile of depth) is nearest, or None."""
    trusted = [
        region
        for region in regions
        if region.confidence >= min_confidence and not math.isnan(region.near_depth)
    ]
    return min(trusted, key=lambda region: region.near_depth, default=None)


class NearestRegion(Node):
    def __init__(self):
        super().__init__("nearest_region")
        self.declare_parameter("min_confidence", 0.5)
        self.publisher = self.create_publisher(SalientRegionArray, "nearest", 10)
        self.create_subscription(SalientRegionArray, "regions", self.filter, 10)

    def filter(self, array):
        found = nearest(array.regions, self.get_parameter("min_confidence").value)
        # Also an empty array says something: nothing is near.
        array.regions = [] if found is None else [found]
        self.publisher.publish(array)


def main():
    rclpy.init()
    try:
        rclpy.spin(NearestRegion())
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
