#!/usr/bin/env python3
"""Checks the launch file and the rclpy examples without ROS.

    python3 tests/interop/examples.py PROJECT

The modules of ROS are replaced by empty ones: what is checked is the examples'
own part, on messages made here.
"""

import math
import sys
import xml.etree.ElementTree
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType, SimpleNamespace


def stub(name, **content):
    module = ModuleType(name)
    module.__dict__.update(content)
    sys.modules[name] = module


def load(path):
    spec = spec_from_file_location(path.stem, path)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def region(track_id, near, confidence):
    roi = SimpleNamespace(x_offset=1, y_offset=2, width=3, height=4)
    return SimpleNamespace(
        track_id=track_id, near_depth=near, median_depth=near, confidence=confidence, roi=roi
    )


def main():
    project = Path(sys.argv[1])
    stub("rclpy", init=None, spin=None)
    stub("rclpy.node", Node=object)
    stub("salient_stereo_msgs")
    stub("salient_stereo_msgs.msg", SalientRegionArray=object)
    examples = project / "examples" / "rclpy"

    nearest = load(examples / "nearest_region.py").nearest
    regions = [
        region(1, 9.0, 0.9),
        region(2, math.nan, 0.9),
        region(3, 2.0, 0.1),
        region(4, 4.0, 0.8),
    ]
    assert nearest(regions, 0.5).track_id == 4
    assert nearest(regions, 0.0).track_id == 3
    assert nearest([], 0.5) is None and nearest(regions[1:2], 0.0) is None

    line = load(examples / "print_regions.py").line
    assert "4.00 m" in line(regions[3]) and "80%" in line(regions[3]), line(regions[3])
    assert "?" in line(regions[1]) and "3x4" in line(regions[1])

    launch = project / "config" / "launch"
    compile((launch / "salient_stereo.launch.py").read_text(), "launch.py", "exec")
    root = xml.etree.ElementTree.parse(launch / "salient_stereo.launch.xml").getroot()
    assert root.tag == "launch" and root.find("node").get("exec") == "salient_stereo_node"
    for file in [project / "package.xml", project / "config/dds/fastdds.xml", project / "config/dds/cyclonedds.xml"]:
        xml.etree.ElementTree.parse(file)


main()
