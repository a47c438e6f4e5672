#!/usr/bin/env python3
"""What was seen in many scenes at a glance.

    pip install opencv-python-headless numpy mcap mcap-ros2-support
    python benches/contact_sheet.py OUT.png BAG [BAG …] [--width 420]

Each BAG is an output of `salient_stereo replay`; its last frame becomes one row of OUT.png: the left image with the
regions, their ids and distances, the attention map S, the confidence inside the region of interest, and the
disparity found there (near is red, no disparity is black).
"""

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

TOPICS = ("/overlay/image/compressed", "/saliency/image_rect", "/confidence/image_rect", "/disparity")


def floats(image):
    rows = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.step)
    return rows[:, : 4 * image.width].copy().view("<f4")


def last_frame(path):
    """The last message of each topic."""
    found = {}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages(topics=list(TOPICS)):
            found[channel.topic] = message
    missing = [topic for topic in TOPICS if topic not in found]
    if missing:
        sys.exit(f"{path}: no message on {', '.join(missing)}; is it an output bag of `replay`?")
    return [found[topic] for topic in TOPICS]


def panels(path):
    overlay, saliency, confidence, disparity = last_frame(path)
    picture = cv2.imdecode(np.frombuffer(bytes(overlay.data), np.uint8), cv2.IMREAD_COLOR)
    attention = cv2.applyColorMap((255 * np.clip(floats(saliency), 0, 1)).astype(np.uint8), cv2.COLORMAP_INFERNO)
    found = floats(disparity.image)
    valid = found >= disparity.min_disparity
    span = max(np.percentile(found[valid], 98), 1) if valid.any() else 1
    colours = cv2.applyColorMap((255 * np.clip(found / span, 0, 1)).astype(np.uint8), cv2.COLORMAP_JET)
    colours[~valid] = 0
    trust = cv2.applyColorMap((255 * np.clip(floats(confidence), 0, 1)).astype(np.uint8), cv2.COLORMAP_BONE)
    return [picture, attention, trust, colours]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", help="PNG to write")
    parser.add_argument("bag", nargs="+", help="output bags of `salient_stereo replay`")
    parser.add_argument("--width", type=int, default=420, help="pixels of a panel")
    args = parser.parse_args()
    rows = []
    for bag in args.bag:
        row = []
        for panel in panels(bag):
            height = round(panel.shape[0] * args.width / panel.shape[1])
            row.append(cv2.resize(panel, (args.width, height), interpolation=cv2.INTER_AREA))
        strip = np.full((16, 4 * args.width, 3), 32, np.uint8)
        cv2.putText(strip, Path(bag).stem, (4, 12), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (255, 255, 255), 1, cv2.LINE_AA)
        rows += [strip, np.hstack(row)]
    if not cv2.imwrite(args.out, np.vstack(rows)):
        sys.exit(f"{args.out}: cannot be written")


if __name__ == "__main__":
    main()
