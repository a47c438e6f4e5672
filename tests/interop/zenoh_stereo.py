"""A stereo camera and a viewer on Zenoh, in the form of rmw_zenoh_cpp.

Keys, tokens, attachments and CDR are written out here on their own, from the
published design of rmw_zenoh, so that the node is not tested against itself.
"""

import argparse
import json
import struct
import sys
import threading
import time

import numpy as np
import zenoh

IMAGE = "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"
INFO = "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"
START_NS = 1_000_000_000
PATIENCE_US = 20_000_000


class Cdr:
    """Little-endian CDR; numbers are aligned counting from behind the header."""

    def __init__(self):
        self.bytes = bytearray()

    def put(self, form, *values):
        size = struct.calcsize("<" + form)
        self.bytes.extend(bytes(-len(self.bytes) % size))
        for value in values:
            self.bytes.extend(struct.pack("<" + form, value))
        return self

    def text(self, text):
        data = text.encode() + b"\0"
        self.put("I", len(data)).bytes.extend(data)
        return self

    def header(self, stamp_ns):
        return self.put("i", stamp_ns // 10**9).put("I", stamp_ns % 10**9).text("left_optical")

    def done(self):
        return b"\x00\x01\x00\x00" + bytes(self.bytes)


def image(stamp_ns, pixels):
    height, width, channels = pixels.shape
    cdr = Cdr().header(stamp_ns).put("I", height, width).text("rgb8")
    cdr.put("B", 0).put("I", channels * width, pixels.size).bytes.extend(pixels.tobytes())
    return cdr.done()


def info(stamp_ns, width, height, tx):
    f, cx, cy = 300.0, width / 2, height / 2
    cdr = Cdr().header(stamp_ns).put("I", height, width).text("plumb_bob")
    cdr.put("I", 5).put("d", *[0.0] * 5)
    cdr.put("d", f, 0, cx, 0, f, cy, 0, 0, 1)
    cdr.put("d", 1, 0, 0, 0, 1, 0, 0, 0, 1)
    cdr.put("d", f, 0, cx, tx, 0, f, cy, 0, 0, 0, 1, 0)
    return cdr.put("I", 0, 0).put("I", 0, 0, 0, 0).put("B", 0).done()


def views(width, height):
    """A wall 10 px of disparity away, and a box of 30 px before it."""
    noise = np.random.default_rng(7).integers(0, 256, (height, width + 40, 1), np.uint8)
    wall = np.concatenate([noise // 2, noise, noise // 2], axis=2)
    left, right = wall[:, :width].copy(), wall[:, 10 : width + 10].copy()
    box = np.concatenate([noise, noise // 4, noise // 4], axis=2)[:50, :50]
    left[40:90, 140:190] = box
    right[40:90, 110:160] = box
    return left, right


class Peer:
    def __init__(self, endpoint, domain, namespace):
        config = zenoh.Config()
        config.insert_json5("mode", '"peer"')
        config.insert_json5("connect/endpoints", json.dumps([endpoint]))
        config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
        config.insert_json5("scouting/multicast/enabled", "false")
        # By default a busy machine drops what a link cannot take within 1 ms.
        drop = "transport/link/tx/queue/congestion_control/drop"
        for limit in ("wait_before_drop", "max_wait_before_drop_fragments"):
            config.insert_json5(f"{drop}/{limit}", str(PATIENCE_US))
        self.session = zenoh.open(config)
        self.domain, self.namespace = domain, namespace
        self.prefix = f"@ros2_lv/{domain}/{self.session.zid()}/0"
        self.suffix = f"%/{namespace.replace('/', '%')}/zenoh_camera"
        self.kept = [self.session.liveliness().declare_token(f"{self.prefix}/0/NN/{self.suffix}")]

    def token(self, number, kind, topic, type_name, type_hash, qos):
        name = f"{self.namespace}/{topic}".replace("/", "%")
        key = f"{self.prefix}/{number}/{kind}/{self.suffix}/{name}/{type_name}/{type_hash}/{qos}"
        self.kept.append(self.session.liveliness().declare_token(key))

    def key(self, topic, type_name, type_hash):
        return f"{self.domain}{self.namespace}/{topic}/{type_name}/{type_hash}"

    def tokens(self):
        found = self.session.liveliness().get(f"@ros2_lv/{self.domain}/**")
        return [str(reply.ok.key_expr).split("/") for reply in found if reply.ok]


def main():
    parse = argparse.ArgumentParser()
    parse.add_argument("--endpoint", required=True)
    parse.add_argument("--domain", type=int, required=True)
    parse.add_argument("--namespace", default="/robot")
    parse.add_argument("--pairs", type=int, default=10)
    parse.add_argument("--width", type=int, default=320)
    parse.add_argument("--height", type=int, default=120)
    parse.add_argument("--rate", type=float, default=5.0)
    parse.add_argument("--listen", nargs="*", default=[], help="TOPIC=TYPE of dense topics")
    arguments = parse.parse_args()
    peer = Peer(arguments.endpoint, arguments.domain, arguments.namespace)

    received, lock = {}, threading.Lock()

    def listen(number, topic, type_name):
        # The node's hash is taken from its token below; any is heard here.
        def heard(sample):
            payload, attachment = bytes(sample.payload), bytes(sample.attachment)
            sequence, _, length = struct.unpack("<qqB", attachment[:17])
            seconds, nanoseconds = struct.unpack("<iI", payload[4:12])
            good = length == 16 and len(attachment) == 33 and payload[:4] == b"\x00\x01\x00\x00"
            with lock:
                received.setdefault(topic, []).append(
                    (seconds * 10**9 + nanoseconds, sequence, len(payload), good)
                )

        peer.kept.append(peer.session.declare_subscriber(peer.key(topic, type_name, "*"), heard))
        peer.token(number, "MS", topic, type_name, "RIHS01_0", "::,5:,:,:,,")

    listen(1, "regions", "salient_stereo_msgs::msg::dds_::SalientRegionArray_")
    for number, rule in enumerate(arguments.listen, 20):
        topic, type_name = rule.split("=")
        listen(number, topic, type_name)
    publishers = {}
    for number, (topic, type_name, type_hash) in enumerate(
        [
            ("left/image_rect", "sensor_msgs::msg::dds_::Image_", IMAGE),
            ("right/image_rect", "sensor_msgs::msg::dds_::Image_", IMAGE),
            ("left/camera_info", "sensor_msgs::msg::dds_::CameraInfo_", INFO),
            ("right/camera_info", "sensor_msgs::msg::dds_::CameraInfo_", INFO),
        ],
        2,
    ):
        peer.token(number, "MP", topic, type_name, type_hash, "2::,5:,:,:,,")
        publishers[topic] = peer.session.declare_publisher(peer.key(topic, type_name, type_hash))

    node = []
    for _ in range(200):
        node = [parts for parts in peer.tokens() if parts[8] == "salient_stereo"]
        if any(parts[5] == "MS" and parts[9].endswith("%left%image_rect") for parts in node):
            break
        time.sleep(0.05)
    time.sleep(1.0)

    left, right = views(arguments.width, arguments.height)
    sent = []
    for number in range(arguments.pairs):
        stamp = START_NS + number * 100_000_000
        attachment = struct.pack("<qqB", number + 1, time.time_ns(), 16) + bytes(range(16))
        for side, pixels, tx in (("left", left, 0.0), ("right", right, -60.0)):
            told = info(stamp, arguments.width, arguments.height, tx)
            publishers[f"{side}/camera_info"].put(told, attachment=attachment)
            publishers[f"{side}/image_rect"].put(image(stamp, pixels), attachment=attachment)
        sent.append(stamp)
        time.sleep(1 / arguments.rate)
    topics = ["regions"] + [rule.split("=")[0] for rule in arguments.listen]
    for _ in range(200):
        with lock:
            if all(len(received.get(topic, [])) == len(sent) for topic in topics):
                break
        time.sleep(0.05)

    with lock:
        regions = received.get("regions", [])
        outcome = {
            "sent": len(sent),
            "answered": sum(stamp in sent for stamp, *_ in regions),
            "well_formed": all(good for rows in received.values() for *_, good in rows),
            "sequence": [sequence for _, sequence, _, _ in regions],
            "bytes": {t: round(sum(r[2] for r in rows) / len(rows)) for t, rows in received.items()},
            "messages": {topic: len(rows) for topic, rows in received.items()},
            "hashes": {parts[10]: parts[11] for parts in node if parts[5] in ("MP", "SS")},
            "node_token": any(parts[5] == "NN" for parts in node),
        }
    print(json.dumps(outcome))
    peer.session.close()
    return 0 if outcome["answered"] == outcome["sent"] else 1


if __name__ == "__main__":
    sys.exit(main())
