#!/usr/bin/env python3
"""Prints what the node sees: one line per region, the most important first.

python3 print_regions.py --ros-args -r regions:=/stereo/regions
"""

import math

import rclpy
from rclpy.node import Node
from salient_stereo_msgs.msg import SalientRegionArray


def line(region):
    """One region in words; what was not measured is NaN."""
    distance = "?" if math.isnan(region.median_depth) else f"{region.median_depth:.2f} m"
    box = region.roi
    return (
        f"  id {region.track_id:>4}  {distance:>9}  {region.confidence:4.0%}"
        f"  box {box.x_offset},{box.y_offset} {box.width}x{box.height}"
    )


class PrintRegions(Node):
    def __init__(self):
        super().__init__("print_regions")
        self.create_subscription(SalientRegionArray, "regions", self.show, 10)

    def show(self, array):
        stamp = array.header.stamp
        print(f"{stamp.sec}.{stamp.nanosec:09d}  {len(array.regions)} regions")
        for region in array.regions:
            print(line(region))


def main():
    rclpy.init()
    try:
        rclpy.spin(PrintRegions())
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
