"""Renders that are killed, previews that are read while they are written, and pictures sent to the viewer tev.

    HALFLIGHT=target/quick/halflight python3 tests/peers/live.py [--kills 50] [--reads 1000]

Renders with `--continue` are killed by SIGKILL at random times until there were enough kills; the picture of the one
that ends must have the bytes of an uninterrupted render. Previews are read until there were enough reads, each of
which must be a whole picture. The bytes that `--tev` sends are compared with those of tev's
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
import zlib
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


def is_whole_png(data):
    """Whether all chunks of a PNG are there with right sums, and as many samples as pixels."""
    at, packed, kinds = 8, b"", []
    while at + 12 <= len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] != zlib.crc32(kind + body):
            return False
        packed += body if kind == b"IDAT" else b""
        kinds.append(kind)
        at += 12 + length
    return kinds[-1:] == [b"IEND"] and len(zlib.decompress(packed)) == SIZE[1] * (1 + 3 * SIZE[0])


def is_whole_pfm(data):
    """Whether a PFM has all pixels, each of which is finite."""
    header = f"PF\n{SIZE[0]} {SIZE[1]}\n-1.0\n".encode()
    pixels = np.frombuffer(data[len(header) :], dtype="<f4") if data.startswith(header) else np.zeros(0)
    return len(pixels) == 3 * SIZE[0] * SIZE[1] and bool(np.isfinite(pixels).all())


def previews(folder, wanted):
    """Whether all of `wanted` reads of a preview, which one render after the other rewrites, are whole pictures."""
    good = True
    for preview, is_whole in [(folder / "now.png", is_whole_png), (folder / "now.pfm", is_whole_pfm)]:
        reads = broken = seed = 0
        versions = set()
        render = None
        while reads < wanted:
            if render is None or render.poll() is not None:
                seed += 1
                flags = ["--preview", preview, "--every", "1ms", "--seed", str(seed)]
                render = subprocess.Popen(command(32, folder / "result.pfm", *flags))
            if preview.exists():
                data = preview.read_bytes()
                reads += 1
                broken += not is_whole(data)
                versions.add(data)
            time.sleep(0.002)
        render.wait()
        print(f"{preview.suffix}: {reads} reads of {len(versions)} pictures, {broken} of them broken")
        good = good and broken == 0 and len(versions) > wanted / 50
    return good


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
    parser.add_argument("--reads", type=int, default=1000)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        good = [packets(folder), previews(folder, arguments.reads), kills(folder, arguments.kills)]
    raise SystemExit(0 if all(good) else 1)
