#!/usr/bin/env python3
"""Decodes a bag of results with two independent readers and checks it.

    python3 -m venv venv && venv/bin/pip install rosbags mcap-ros2-support numpy
    venv/bin/python tests/interop/read_bag.py OUT.mcap [IN.mcap]

OUT is a bag written by `salient_stereo replay` (a single file or a folder). With
IN, the bag it was made from, the number of region arrays is compared with the
number of pairs of equal stamps in it. Exit code 0: everything holds.
"""

import struct
import sys
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.reader import read_ros2_messages
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

FAULTS = []
HASHES = {}


def check(condition, text):
    if not condition:
        FAULTS.append(text)


def stamp(header):
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def files_of(path):
    return sorted(path.glob("*.mcap")) if path.is_dir() else [path]


def read_rosbags(path):
    """All messages by topic, decoded with the definitions in the bag."""
    topics = defaultdict(list)
    with Reader(path) as reader:
        store = get_typestore(Stores.EMPTY)
        for connection in reader.connections:
            types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            store.register({k: v for k, v in types.items() if k not in store.types})
        for connection in reader.connections:
            digest = store.hash_rihs01(connection.msgtype)
            # For a file outside of a bag folder this reader knows no hashes;
            # the channel metadata is looked at below.
            check(
                connection.digest in ("", digest),
                f"{connection.topic}: type hash {connection.digest}, but the definition has {digest}",
            )
            HASHES[connection.topic] = digest
            check(
                connection.ext.serialization_format == "cdr",
                f"{connection.topic}: serialization {connection.ext.serialization_format}",
            )
            check(
                len(connection.ext.offered_qos_profiles) == 1,
                f"{connection.topic}: no offered_qos_profiles",
            )
        counts = {c.topic: c.msgcount for c in reader.connections}
        for connection, time, data in reader.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            topics[connection.topic].append((time, message))
    for topic, count in counts.items():
        check(len(topics[topic]) == count, f"{topic}: {len(topics[topic])} of {count} messages")
    return topics


def read_mcap(path):
    """All messages by topic, decoded by mcap-ros2-support."""
    topics = defaultdict(list)
    for file in files_of(path):
        with file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            header = reader.get_header()
            check(header.profile == "ros2", f"{file}: profile '{header.profile}'")
            names = [metadata.name for metadata in reader.iter_metadata()]
            check("rosbag2" in names, f"{file}: metadata records {names}")
            for channel in reader.get_summary().channels.values():
                found = channel.metadata.get("topic_type_hash")
                wanted = HASHES.get(channel.topic)
                check(found == wanted, f"{channel.topic}: {found} instead of {wanted}")
                profiles = channel.metadata.get("offered_qos_profiles", "")
                check("reliability: reliable" in profiles, f"{channel.topic}: {profiles}")
        for message in read_ros2_messages(file):
            topics[message.channel.topic].append((message.log_time_ns, message.ros_msg))
    return topics


def pixels(image, dtype, channels=1):
    size = np.dtype(dtype).itemsize * channels
    check(image.step == image.width * size, f"step {image.step} of width {image.width}")
    data = np.frombuffer(bytes(image.data), dtype)
    shape = (image.height, image.width) + ((channels,) if channels > 1 else ())
    if data.size != np.prod(shape):
        check(False, f"{data.size} values for {shape}")
        return np.zeros(shape, dtype)
    return data.reshape(shape)


def check_disparity(at, message):
    image = message.image
    check(image.encoding == "32FC1", f"{at}: disparity is {image.encoding}")
    check(message.f > 0 and np.isfinite(message.f), f"{at}: f = {message.f}")
    t = message.T if hasattr(message, "T") else message.t
    check(t > 0 and np.isfinite(t), f"{at}: t = {t}")
    low, high = message.min_disparity, message.max_disparity
    check(low < high, f"{at}: disparity range {low} .. {high}")
    check(0 < message.delta_d < 1, f"{at}: delta_d = {message.delta_d}")
    window = message.valid_window
    check(
        window.x_offset + window.width <= image.width
        and window.y_offset + window.height <= image.height
        and window.width > 0
        and window.height > 0,
        f"{at}: valid_window {window}",
    )
    d = pixels(image, "<f4")
    check(np.isfinite(d).all(), f"{at}: disparity that is not finite")
    invalid = d == np.float32(low - 1)
    rest = d[~invalid]
    check(((rest >= low) & (rest <= high)).all(), f"{at}: disparity outside {low} .. {high}")
    return d, ~invalid, message.f * t


def check_depth(at, message, disparity, valid, scale):
    check(message.encoding == "32FC1", f"{at}: depth is {message.encoding}")
    z = pixels(message, "<f4")
    check(z.shape == disparity.shape, f"{at}: depth is {z.shape}, disparity {disparity.shape}")
    check(np.isnan(z[~valid]).all(), f"{at}: depth without disparity is not NaN")
    finite = np.isfinite(z)
    check((z[finite] > 0).all(), f"{at}: depth that is not positive")
    check(not np.isnan(z[valid]).any(), f"{at}: NaN depth with a disparity")
    expected = scale / disparity[finite]
    error = np.abs(z[finite] / expected - 1).max(initial=0)
    check(error < 1e-3, f"{at}: depth differs from f t / d by {error:.1e}")


def check_unit(at, name, message):
    check(message.encoding == "32FC1", f"{at}: {name} is {message.encoding}")
    values = pixels(message, "<f4")
    check(((values >= 0) & (values <= 1)).all(), f"{at}: {name} outside 0 .. 1")
    return values


def check_regions(at, array, labels):
    shape = (array.height, array.width)
    check(labels is None or labels.shape == shape, f"{at}: regions are of {shape}")
    used = [region.label for region in array.regions]
    check(len(set(used)) == len(used) and 0 not in used, f"{at}: labels {used}")
    if labels is not None:
        found = set(np.unique(labels).tolist()) - {0}
        check(found <= set(used), f"{at}: label image has {found}, regions {used}")
    for region in array.regions:
        where = f"{at}: region {region.label}"
        roi = region.roi
        check(
            roi.width > 0
            and roi.height > 0
            and roi.x_offset + roi.width <= array.width
            and roi.y_offset + roi.height <= array.height,
            f"{where}: box {roi}",
        )
        for name in ["mean_saliency", "max_saliency", "valid_fraction", "confidence"]:
            value = getattr(region, name)
            check(0 <= value <= 1, f"{where}: {name} = {value}")
        check(region.mean_saliency <= region.max_saliency + 1e-5, f"{where}: saliency")
        measured = ["mean_disparity", "mean_depth", "median_depth", "near_depth", "far_depth"]
        for name in measured:
            value = getattr(region, name)
            check(np.isnan(value) or value > 0, f"{where}: {name} = {value}")
            if region.valid_fraction == 0 and region.track_state != 3:
                check(np.isnan(value), f"{where}: {name} = {value} without a measurement")
        if not np.isnan(region.near_depth):
            order = [region.near_depth, region.median_depth, region.far_depth]
            check(order == sorted(order), f"{where}: depths {order}")
        check(len(region.contour.points) >= 3, f"{where}: contour")
        if len(region.mask.data):
            data = bytes(region.mask.data)
            width, height, depth, color = struct.unpack(">IIBB", data[16:26])
            check(data[:8] == b"\x89PNG\r\n\x1a\n", f"{where}: mask is no PNG")
            check(
                (width, height, depth, color) == (roi.width, roi.height, 8, 0),
                f"{where}: mask is {width}x{height}, {depth} bit, box {roi.width}x{roi.height}",
            )
        if labels is not None and region.track_state != 3:
            area = int((labels == region.label).sum())
            check(area == region.area, f"{where}: area {region.area}, {area} labelled pixels")


def check_detections(at, array, flat, solid):
    placed = [r for r in array.regions if np.isfinite([r.position.x, r.position.y, r.position.z]).all()]
    check(len(flat.detections) == len(array.regions), f"{at}: {len(flat.detections)} in the image")
    check(len(solid.detections) == len(placed), f"{at}: {len(solid.detections)} in space")
    for region, detection in zip(array.regions, flat.detections):
        box, roi = detection.bbox, region.roi
        left, top = box.center.position.x - box.size_x / 2, box.center.position.y - box.size_y / 2
        check((left, top) == (roi.x_offset, roi.y_offset), f"{at}: box at {left}, {top}")
        check(detection.id in ("", str(region.track_id)), f"{at}: id {detection.id}")
    for region, detection in zip(placed, solid.detections):
        check(detection.bbox.center.position.z == region.position.z, f"{at}: detection in space")
    return len(placed)


def check_markers(messages, places):
    for time, message in messages:
        check(len(message.markers) == 2 * places[time], f"{time}: {len(message.markers)} markers")
        for marker in message.markers:
            check(stamp(marker.header) == time, f"{time}: stamp of a marker")
            check(marker.lifetime.nanosec > 0, f"{time}: a marker that stays for ever")


def check_annotations(messages, regions):
    check(len(messages) == len(regions), f"/regions/annotations: {len(messages)}")
    for time, message in messages:
        array = regions.get(time)
        check(array is not None, f"/regions/annotations: no regions at {time}")
        found = (len(message.points), len(message.texts))
        if array is None or found != (len(array.regions), len(array.regions)):
            check(False, f"{time}: {found} outlines and texts")
            continue
        for region, outline, text in zip(array.regions, message.points, message.texts):
            stamps = {t.timestamp.sec * 1_000_000_000 + t.timestamp.nanosec for t in (outline, text)}
            check(stamps == {time}, f"{time}: annotations of {stamps}")
            drawn = [(p.x - 0.5, p.y - 0.5) for p in outline.points]
            contour = [(p.x, p.y) for p in region.contour.points]
            check(drawn == contour, f"{time}: outline of {len(drawn)} points, contour {len(contour)}")
            check(text.text != "" and outline.thickness > 0, f"{time}: {text.text!r}")


HEADERLESS = ["/markers", "/regions/annotations"]


def check_results(topics):
    marker_messages, annotations = (topics.get(topic, []) for topic in HEADERLESS)
    topics = {topic: messages for topic, messages in topics.items() if topic not in HEADERLESS}
    by_topic = {
        topic: {stamp(m.header): m for _, m in messages}
        for topic, messages in topics.items()
        if messages and hasattr(messages[0][1], "header")
    }
    regions = by_topic.get("/regions", {})
    check(regions, "no /regions")
    for topic, messages in topics.items():
        check(len(by_topic.get(topic, {})) == len(messages), f"{topic}: a stamp comes twice")
        check(len(messages) == len(regions), f"{topic}: {len(messages)} for {len(regions)} arrays")
        for time, message in messages:
            check(time == stamp(message.header), f"{topic}: log time {time} is not the stamp")
    counts = Counter()
    places = {}
    for at, array in regions.items():
        here = {topic: messages.get(at) for topic, messages in by_topic.items()}
        for topic, message in here.items():
            check(message is not None, f"{topic}: nothing at {at}")
            if message is not None:
                frame = message.header.frame_id
                check(frame == array.header.frame_id, f"{topic}: frame '{frame}'")
        labels = None
        if here.get("/regions/label_image") is not None:
            image = here["/regions/label_image"]
            check(image.encoding == "mono16", f"{at}: labels are {image.encoding}")
            labels = pixels(image, "<u2")
        check_regions(at, array, labels)
        if here.get("/disparity") is not None:
            d, valid, scale = check_disparity(at, here["/disparity"])
            counts["valid pixels"] += int(valid.sum())
            if here.get("/depth/image_rect") is not None:
                check_depth(at, here["/depth/image_rect"], d, valid, scale)
            info = here.get("/depth/camera_info")
            if info is not None:
                p = info.p if hasattr(info, "p") else info.P
                check(abs(p[0] - here["/disparity"].f) < 1e-3 * p[0], f"{at}: P[0] = {p[0]}")
                check((info.height, info.width) == d.shape, f"{at}: camera info of {d.shape}")
        for topic in ["/confidence/image_rect", "/saliency/image_rect"]:
            if here.get(topic) is not None:
                check_unit(at, topic, here[topic])
        if here.get("/detections_2d") is not None and here.get("/detections_3d") is not None:
            places[at] = check_detections(at, array, here["/detections_2d"], here["/detections_3d"])
        counts["regions"] += len(array.regions)
    check(len(marker_messages) == len(places), f"/markers: {len(marker_messages)}")
    check_markers(marker_messages, places)
    check_annotations(annotations, regions)
    return len(regions), counts


def pairs_in(path):
    """Stamps that both image topics of a bag have."""
    sides = defaultdict(set)
    for file in files_of(path):
        for message in read_ros2_messages(file):
            topic = message.channel.topic
            for side in ["left", "right"]:
                if f"/{side}/image_" in topic:
                    sides[side].add(stamp(message.ros_msg.header))
    return len(sides["left"] & sides["right"])


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    path = Path(sys.argv[1])
    rosbags, mcap = read_rosbags(path), read_mcap(path)
    counts = [{topic: len(m) for topic, m in topics.items()} for topics in (rosbags, mcap)]
    check(counts[0] == counts[1], f"rosbags reads {counts[0]}, mcap-ros2-support {counts[1]}")
    arrays = 0
    for name, topics in [("rosbags", rosbags), ("mcap-ros2-support", mcap)]:
        arrays, found = check_results(topics)
        print(f"{name}: {arrays} region arrays, {dict(found)}, topics {sorted(topics)}")
    if len(sys.argv) == 3:
        pairs = pairs_in(Path(sys.argv[2]))
        check(arrays == pairs, f"{arrays} region arrays for {pairs} pairs")
        print(f"input: {pairs} pairs")
    for fault in FAULTS[:50]:
        print("FAULT:", fault)
    print(f"{len(FAULTS)} faults")
    sys.exit(1 if FAULTS else 0)


main()
