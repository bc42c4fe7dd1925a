# SPDX-License-Identifier: Apache-2.0
"""A faulty network: proxy.py PORT-FILE TARGET-PORT ORDER-FILE passes frames on between its callers and the target.

When ORDER-FILE holds "ACTION FIELD", the action is applied to the next message with this field of the envelope (proto/farm.proto),
in either direction, and the file is removed:
  cut    half of the message passes, then the connection is closed on both sides
  stall  half of the message passes, then nothing more in either direction until one side hangs up
  twice  the message is sent twice
  slow   the message takes two seconds, piece by piece; then the file ORDER-FILE.done is created
  late   the message, and all that follows it, arrive two and a half seconds later
  flip   a bit is flipped: in the middle of the first such message, then anywhere, including lengths and checksums"""
import asyncio, os, random, sys

port_file, target, order_file = sys.argv[1], int(sys.argv[2]), sys.argv[3]


def field_of(header):
    number, shift = 0, 0
    for byte in header[:5]:
        number |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            break
    return number >> 3


def order_for(field):
    try:
        with open(order_file) as f:
            action, wanted = f.read().split()
    except (FileNotFoundError, ValueError):
        return ""
    if int(wanted) != field:
        return ""
    os.unlink(order_file)
    return action


class Pair:
    """Two ends of a connection."""
    def __init__(self):
        self.stalled = False


chance = random.Random(0)
flips = 0


def flip(frame):
    global flips
    bit = chance.randrange(8 * len(frame)) if flips else 4 * len(frame)
    flips += 1
    changed = bytearray(frame)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


async def one_way(pair, source, sink):
    before = 8  # bytes before the header: the first frame has only its lengths
    try:
        while True:
            prefix = await source.readexactly(before)
            header = int.from_bytes(prefix[:4], "big")
            frame = prefix + await source.readexactly(header + int.from_bytes(prefix[4:8], "big"))
            action = "" if pair.stalled else order_for(field_of(frame[before:]))
            before = 16
            if pair.stalled:
                continue
            if action in ("cut", "stall"):
                sink.write(frame[:len(frame) // 2])
                await sink.drain()
                if action == "cut":
                    break
                pair.stalled = True
                continue
            if action == "slow":
                piece = len(frame) // 20 + 1
                for at in range(0, len(frame) - piece, piece):
                    sink.write(frame[at:at + piece])
                    await asyncio.sleep(0.1)
                frame = frame[(len(frame) - 1) // piece * piece:]
            if action == "flip":
                frame = flip(frame)
            if action == "late":
                await asyncio.sleep(2.5)
            sink.write(frame * (2 if action == "twice" else 1))
            await sink.drain()
            if action == "slow":
                open(order_file + ".done", "w").close()
    except (asyncio.IncompleteReadError, OSError):
        pass
    sink.close()


async def pair_up(near_reader, near_writer):
    try:
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", target)
    except OSError:
        near_writer.close()
        return
    pair = Pair()
    ways = [asyncio.ensure_future(one_way(pair, near_reader, far_writer)),
            asyncio.ensure_future(one_way(pair, far_reader, near_writer))]
    await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
    near_writer.close()
    far_writer.close()
    for way in ways:
        way.cancel()


async def main():
    server = await asyncio.start_server(pair_up, "127.0.0.1", 0)
    with open(port_file + ".tmp", "w") as f:
        print(server.sockets[0].getsockname()[1], file=f)
    os.rename(port_file + ".tmp", port_file)
    await server.serve_forever()

asyncio.run(main())
