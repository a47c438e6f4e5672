#!/usr/bin/env python3
"""Cyclone DDS as the peer of a running node.

Publishes stereo pairs and camera infos under their ROS 2 names, receives the
regions, and checks that each pair comes back as one region array. Needs
`pip install cyclonedds numpy`, and no ROS. Start the node first, on the same
domain and on this machine only:

    ROS_DOMAIN_ID=42 ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST salient_stereo_node
    python3 tests/interop/cyclone_stereo.py --domain 42

Prints counts as one JSON line. Exit code 0: one array per pair; 3: some are
missing; 1: anything else.
"""

import argparse
import json
import os
import struct
import sys
import time
from dataclasses import dataclass

LOOPBACK = """<CycloneDDS><Domain>
  <General>
    <Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces>
    <AllowMulticast>false</AllowMulticast>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex>
    <Peers><Peer Address="127.0.0.1"/></Peers>
  </Discovery>
  <Internal><SocketReceiveBufferSize max="{buffer}"/></Internal>
</Domain></CycloneDDS>"""

arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
arguments.add_argument("--domain", type=int, default=42)
arguments.add_argument("--pairs", type=int, default=100)
arguments.add_argument("--rate", type=float, default=10.0, help="pairs per second")
arguments.add_argument("--width", type=int, default=1242)
arguments.add_argument("--height", type=int, default=375)
arguments.add_argument("--reliability", choices=["reliable", "best_effort"], default="reliable")
arguments.add_argument("--namespace", default="", help="of the node, as in /robot")
arguments.add_argument("--patience", type=float, default=20.0, help="seconds for discovery")
arguments.add_argument("--start", type=int, default=1000, help="stamp of the first pair, seconds")
arguments.add_argument(
    "--listen", type=float, default=0.0, help="send nothing: listen to the regions for so long"
)
arguments.add_argument("--buffer", default="4MB", help="our socket receive buffer")
options = arguments.parse_args()
os.environ["CYCLONEDDS_URI"] = LOOPBACK.format(buffer=options.buffer)

import numpy as np  # noqa: E402
from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct, types  # noqa: E402
from cyclonedds.pub import DataWriter  # noqa: E402
from cyclonedds.sub import DataReader  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: types.int32
    nanosec: types.uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Roi(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    x_offset: types.uint32
    y_offset: types.uint32
    height: types.uint32
    width: types.uint32
    do_rectify: bool


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header
    height: types.uint32
    width: types.uint32
    encoding: str
    is_bigendian: types.uint8
    step: types.uint32
    data: types.sequence[types.uint8]

    def serialize(self, *args, **kwargs):
        """The bytes laid out once, with the stamp of this sample: packing a
        million numbers one by one would take longer than the frame period."""
        payload = bytearray(self.prepared)
        # 4 bytes of encapsulation, then the stamp.
        struct.pack_into("<iI", payload, 4, self.header.stamp.sec, self.header.stamp.nanosec)
        return bytes(payload)


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    header: Header
    height: types.uint32
    width: types.uint32
    distortion_model: str
    d: types.sequence[types.float64]
    k: types.array[types.float64, 9]
    r: types.array[types.float64, 9]
    p: types.array[types.float64, 12]
    binning_x: types.uint32
    binning_y: types.uint32
    roi: Roi


@dataclass
class Point32(IdlStruct, typename="geometry_msgs::msg::dds_::Point32_"):
    x: types.float32
    y: types.float32
    z: types.float32


@dataclass
class Polygon(IdlStruct, typename="geometry_msgs::msg::dds_::Polygon_"):
    points: types.sequence[Point32]


@dataclass
class Point(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: types.float64
    y: types.float64
    z: types.float64


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: types.float64
    y: types.float64
    z: types.float64


@dataclass
class CompressedImage(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImage_"):
    header: Header
    format: str
    data: types.sequence[types.uint8]


@dataclass
class SalientRegion(IdlStruct, typename="salient_stereo_msgs::msg::dds_::SalientRegion_"):
    label: types.uint16
    track_id: types.uint32
    track_state: types.uint8
    track_age: types.float32
    roi: Roi
    contour: Polygon
    mask: CompressedImage
    area: types.uint32
    mean_saliency: types.float32
    max_saliency: types.float32
    valid_fraction: types.float32
    mean_disparity: types.float32
    disparity_stddev: types.float32
    mean_depth: types.float32
    median_depth: types.float32
    depth_stddev: types.float32
    near_depth: types.float32
    far_depth: types.float32
    confidence: types.float32
    position: Point
    position_covariance: types.array[types.float64, 9]
    size: Vector3
    velocity: Vector3


@dataclass
class SalientRegionArray(
    IdlStruct, typename="salient_stereo_msgs::msg::dds_::SalientRegionArray_"
):
    header: Header
    height: types.uint32
    width: types.uint32
    stereo_time_offset: types.float64
    regions: types.sequence[SalientRegion]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: types.uint8
    name: str
    message: str
    hardware_id: str
    values: types.sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: types.sequence[DiagnosticStatus]


# What a pair waits and takes outside the stages, the longest of the last second.
BEYOND = "longest latency beyond the stages (ms)"


def prepared_image(pixels):
    """An Image message of these rgb8 pixels as CDR, little-endian, stamp zero."""
    height, width, _ = pixels.shape
    out = bytearray(b"\x00\x01\x00\x00")

    def put(form, size, *values):
        out.extend(b"\0" * (-(len(out) - 4) % size))
        out.extend(struct.pack("<" + form, *values))

    def text(value):
        put("I", 4, len(value) + 1)
        out.extend(value.encode() + b"\0")

    put("iI", 4, 0, 0)
    text("left_optical")
    put("II", 4, height, width)
    text("rgb8")
    put("B", 1, 0)
    put("I", 4, 3 * width)
    put("I", 4, pixels.nbytes)
    out.extend(pixels.tobytes())
    return bytes(out)


def scene(width, height, near=48, far=12):
    """A noise wall `far` px of disparity away with a box at `near` px."""
    rng = np.random.default_rng(1)
    wall = rng.integers(60, 140, (height, width + far, 3), dtype=np.uint8)
    box = rng.integers(0, 255, (height // 2, width // 6, 3), dtype=np.uint8)
    box[:, :, 1:] //= 4
    left = wall[:, :width].copy()
    right = wall[:, far:].copy()
    y, x = height // 4, width // 2
    left[y : y + box.shape[0], x : x + box.shape[1]] = box
    right[y : y + box.shape[0], x - near : x - near + box.shape[1]] = box
    return prepared_image(left), prepared_image(right)


def header(number):
    return Header(Time(options.start + number // 10, number % 10 * 100_000_000), "left_optical")


def camera_info(number, tx):
    f, cx, cy = 700.0, options.width / 2, options.height / 2
    return CameraInfo(
        header=header(number),
        height=options.height,
        width=options.width,
        distortion_model="plumb_bob",
        d=[0.0] * 5,
        k=[f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0],
        r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p=[f, 0.0, cx, tx, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        binning_x=0,
        binning_y=0,
        roi=Roi(0, 0, 0, 0, False),
    )


def image(number, payload):
    message = Image(header(number), 0, 0, "", 0, 0, [])
    message.prepared = payload
    return message


def taken(reader):
    """Messages; a writer that leaves makes samples without one."""
    return [message for message in reader.take(N=100) if hasattr(message, "header")]


def listen(regions):
    """As a viewer that comes late: every array after the first that it gets."""
    stamps = []
    until = time.monotonic() + options.listen
    while time.monotonic() < until:
        for array in taken(regions):
            stamps.append(array.header.stamp.sec * 10 + array.header.stamp.nanosec // 100_000_000)
        time.sleep(0.01)
    gaps = sum(b - a - 1 for a, b in zip(stamps, stamps[1:]))
    print(json.dumps({"arrays": len(stamps), "gaps": gaps}))
    return 0 if stamps and gaps == 0 else 3


def main():
    reliability = (
        Policy.Reliability.Reliable(duration(milliseconds=100))
        if options.reliability == "reliable"
        else Policy.Reliability.BestEffort
    )
    xcdr1 = Policy.DataRepresentation(use_cdrv0_representation=True)
    out_qos = Qos(reliability, Policy.History.KeepLast(5), xcdr1)
    in_qos = Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(1000), xcdr1
    )
    participant = DomainParticipant(options.domain)

    def name(relative):
        return "rt" + options.namespace + "/" + relative

    def writer(relative, kind):
        return DataWriter(participant, Topic(participant, name(relative), kind, qos=out_qos))

    regions = DataReader(
        participant, Topic(participant, name("regions"), SalientRegionArray, qos=in_qos)
    )
    if options.listen:
        return listen(regions)
    left, right = writer("left/image_rect", Image), writer("right/image_rect", Image)
    left_info, right_info = (
        writer("left/camera_info", CameraInfo),
        writer("right/camera_info", CameraInfo),
    )
    diagnostics = DataReader(
        participant, Topic(participant, "rt/diagnostics", DiagnosticArray, qos=in_qos)
    )

    deadline = time.monotonic() + options.patience
    writers = (left, right, left_info, right_info)
    while not all(w.get_matched_subscriptions() for w in writers) or not (
        regions.get_matched_publications()
    ):
        if time.monotonic() > deadline:
            print("no node found: is it running on this domain?", file=sys.stderr)
            return 1
        time.sleep(0.05)
    time.sleep(0.5)

    left_payload, right_payload = scene(options.width, options.height)
    sent_at, arrived, found, counters, beyond = {}, {}, [], {}, []

    def collect():
        for array in taken(regions):
            stamp = (array.header.stamp.sec, array.header.stamp.nanosec)
            arrived.setdefault(stamp, []).append(time.monotonic())
            found.append(len(array.regions))
        for message in taken(diagnostics):
            for status in message.status:
                counters.update({v.key: v.value for v in status.values})
                beyond.extend(float(v.value) for v in status.values if v.key == BEYOND)

    start = time.monotonic()
    for number in range(options.pairs):
        due = start + number / options.rate
        while time.monotonic() < due:
            collect()
            time.sleep(0.002)
        left_info.write(camera_info(number, 0.0))
        right_info.write(camera_info(number, -700.0 * 0.5))
        stamp = header(number).stamp
        sent_at[(stamp.sec, stamp.nanosec)] = time.monotonic()
        left.write(image(number, left_payload))
        right.write(image(number, right_payload))
    # Late arrays, and the diagnostics of the last second.
    settle = time.monotonic() + 4.0
    while time.monotonic() < settle:
        collect()
        time.sleep(0.01)

    complete = [stamp for stamp in sent_at if len(arrived.get(stamp, [])) == 1]
    latencies = sorted(1e3 * (arrived[s][0] - sent_at[s]) for s in complete)

    def percentile(share):
        return round(latencies[int(share * (len(latencies) - 1))], 1) if latencies else None

    # Of each second the slowest pair: with 30 pairs a second, 99 % of all pairs
    # are faster than the 70th of 100 such seconds.
    beyond.sort()

    def slowest(share):
        return beyond[int(share * (len(beyond) - 1))] if beyond else None

    def counter(key):
        return int(counters[key]) if key in counters else None

    print(
        json.dumps(
            {
                "reliability": options.reliability,
                "rate": options.rate,
                "sent": len(sent_at),
                "left_received": counter("left images"),
                "right_received": counter("right images"),
                "pairs_of_node": counter("pairs"),
                "pairs_displaced": counter("pairs replaced by a newer one"),
                "arrays": len(complete),
                "repeated": sum(len(times) > 1 for times in arrived.values()),
                "regions_per_array": round(sum(found) / max(len(found), 1), 2),
                "latency_ms_p50": percentile(0.5),
                "latency_ms_p95": percentile(0.95),
                "latency_ms_p99": percentile(0.99),
                "stages_ms": counters.get("total (ms)"),
                "latency_inside_ms": counters.get("latency from pair to regions (ms)"),
                "slowest_of_a_second_beyond_stages_ms": [slowest(p) for p in (0.5, 0.7, 0.9, 1.0)],
                "last_answered": all(
                    stamp in arrived for stamp in list(sent_at)[-min(5, len(sent_at)) :]
                ),
                "node_receive_buffer": counter("receive buffer (bytes)"),
                "datagrams_lost": counter(
                    "datagrams lost to full receive buffers on this machine (RcvbufErrors)"
                ),
            }
        )
    )
    return 0 if len(complete) == len(sent_at) else 3


if __name__ == "__main__":
    sys.exit(main())
