"""Renders that are killed, and pictures sent to the viewer tev.

    HALFLIGHT=target/quick/halflight python3 tests/peers/live.py [--kills 50]

Renders with `--continue` are killed by SIGKILL at random times until there were enough kills; the picture of the one
that ends must have the bytes of an uninterrupted render. The bytes that `--tev` sends are compared with those of tev's
own client for the same pixels (PyPI `tevclient` and `numpy`).
"""

import argparse
import os
import random
import socket
import struct
import subprocess
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import tevclient.packet

ROOT = Path(__file__).resolve().parent.parent.parent
PROGRAM = os.environ.get("HALFLIGHT", ROOT / "target/release/halflight")
SCENE = ROOT / "scenes/cornell/cornell.obj"
SIZE = (96, 64)


def command(spp, output, *flags):
    size = f"{SIZE[0]}x{SIZE[1]}"
    return [PROGRAM, "render", SCENE, "--size", size, "--spp", str(spp), "-q", "-o", output, *flags]


def kills(folder, wanted):
    """Number of renders until one ends after so many kills, and whether its pixels have the same bytes."""
    whole, parts = folder / "whole.pfm", folder / "parts.pfm"
    spp = 4096
    start = time.monotonic()
    subprocess.run(command(spp, whole), check=True)
    # On average ten renders' time passes, so that the work of most of them is lost or taken up.
    longest = (time.monotonic() - start) / 5
    continued = command(spp, parts, "--continue", folder / "state.film", "--checkpoint-every", "50ms")
    killed = finished = 0
    while killed < wanted:
        render = subprocess.Popen(continued)
        try:
            render.wait(random.uniform(0, longest))
            finished += 1
            # Its work is done: the next begins anew.
            assert render.returncode == 0 and parts.read_bytes() == whole.read_bytes()
            (folder / "state.film").unlink()
        except subprocess.TimeoutExpired:
            render.kill()
            render.wait()
            killed += 1
    subprocess.run(continued, check=True)
    same = parts.read_bytes() == whole.read_bytes()
    print(f"{killed} kills, {finished + 1} renders ended: {'same bytes' if same else 'OTHER BYTES'}")
    return same


def packets(folder):
    """Whether all packets are those of tev's client, whose last one is the picture."""
    server = socket.create_server(("127.0.0.1", 0))
    received = bytearray()

    def listen():
        connection = server.accept()[0]
        while bytes_now := connection.recv(1 << 16):
            received.extend(bytes_now)

    listener = threading.Thread(target=listen)
    listener.start()
    picture = folder / "picture.pfm"
    port = server.getsockname()[1]
    subprocess.run(command(64, picture, f"--tev=127.0.0.1:{port}", "--every", "10ms"), check=True)
    listener.join()
    width, height = SIZE
    channels = ["R", "G", "B"]
    expected = tevclient.packet.create_image("halflight", width, height, channels, True)
    same, updates = received.startswith(expected), 0
    rest = bytes(received[len(expected) :])
    while same and rest:
        length = struct.unpack("<I", rest[:4])[0]
        packet, rest = rest[:length], rest[length:]
        pixels = np.frombuffer(packet[-12 * width * height :], dtype="<f4").reshape(height, width, 3)
        same = packet == tevclient.packet.update_image("halflight", pixels, channels, 0, 0, False)
        updates += 1
    data = picture.read_bytes()[-12 * width * height :]
    saved = np.frombuffer(data, dtype="<f4").reshape(height, width, 3)[::-1]
    same = same and bool(np.array_equal(saved, pixels))
    print(f"{updates} pictures in {len(received)} bytes: {'same bytes' if same else 'OTHER BYTES'} as tevclient's")
    return same


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        good = [packets(Path(name)), kills(Path(name), arguments.kills)]
    raise SystemExit(0 if all(good) else 1)
