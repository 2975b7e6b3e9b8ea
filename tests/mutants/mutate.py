# SPDX-License-Identifier: Apache-2.0
"""Mutations of a file's bytes: what broken disks, other programs and people make of files. Each takes the bytes and a
random.Random, and returns other bytes."""
import re
import struct
import zlib

NUMBERS = [b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-320", b"0", b"-0", b"-1", b"4294967296", b"2147483648",
           b"9223372036854775807", b"9223372036854775808", b"-9223372036854775809", b"0x10", b"1e", b"1,5", b"", b"--1", b"1" * 400]
STAMPS = [b"0", b"-1", b"1", b"9223372036854775807", b"-9223372036854775808", b"4000000000000000000", b"99999999999999999999"]
WORDS = [b"", b"\xff\xfe", b"\x00", b"%n%s%s", b"../../../../etc/passwd", b"/", b"a" * 5000, b"\xf0\x9f\x98\x80", b"\r\n", b"'", b'"', b"*a",
         b"&a", b"[", b"{", b"}", b"null", b"~", b"true", b"-", b"#", b"<<: *a", b"!!binary x"]
NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
STAMP = re.compile(rb"\d{9,}(?:\.\d+)?")
WORD = re.compile(rb"[A-Za-z_][A-Za-z_0-9]*")


def _place(data, random, most):
    begin = random.randrange(len(data) + 1)
    return begin, min(len(data), begin + random.randint(1, most))


def bits(data, random):
    """One to eight bits are the other way round."""
    out = bytearray(data)
    for _ in range(random.randint(1, 8) if out else 0):
        out[random.randrange(len(out))] ^= 1 << random.randrange(8)
    return bytes(out)


def noise(data, random):
    """A piece of random bytes."""
    begin, end = _place(data, random, 32)
    return data[:begin] + random.randbytes(end - begin) + data[end:]


def zeros(data, random):
    """A sector of zeros, as a power cut leaves it."""
    begin, end = _place(data, random, 512)
    return data[:begin] + bytes(end - begin) + data[end:]


def missing(data, random):
    """A piece is not there."""
    begin, end = _place(data, random, 64)
    return data[:begin] + data[end:]


def twice(data, random):
    """A piece is there twice."""
    begin, end = _place(data, random, 256)
    return data[:end] + data[begin:end] + data[end:]


def cut(data, random):
    """The end is missing."""
    return data[:random.randrange(len(data) + 1)]


def empty(_data, _random):
    """Nothing in it."""
    return b""


def longer(data, random):
    """Many times itself."""
    return data * random.randint(2, 20)


def replaced(pattern, values):
    def change(data, random):
        found = list(pattern.finditer(data))
        if not found:
            return noise(data, random)
        for _ in range(random.choice([1, 1, 1, 2, 5])):
            at = random.choice(found)
            data = data[:at.start()] + random.choice(values) + data[at.end():]
            found = list(pattern.finditer(data))
            if not found:
                break
        return data
    return change


def lines(data, random):
    """A line is missing, twice, elsewhere, empty, very long or with more fields."""
    out = data.split(b"\n")
    i, j = random.randrange(len(out)), random.randrange(len(out))
    what = random.randrange(7)
    if what == 0:
        del out[i]
    elif what == 1:
        out.insert(j, out[i])
    elif what == 2:
        out[i], out[j] = out[j], out[i]
    elif what == 3:
        out[i] = b""
    elif what == 4:
        out[i] = out[i] * 300
    elif what == 5:
        out[i] += b",1,2,3"
    else:
        out[i] = out[i].rsplit(b",", 1)[0]
    return b"\n".join(out)


def chunk(data, random):
    """PNG: a field of a chunk is another, and the sums are right again."""
    if not data.startswith(b"\x89PNG") or len(data) < 33:
        return noise(data, random)
    out, at = data[:8], 8
    chosen = random.choice([0, 0, 0, 1, 2, 3])
    number = 0
    while at + 12 <= len(data):
        length, = struct.unpack(">I", data[at:at + 4])
        kind, body = data[at + 4:at + 8], bytearray(data[at + 8:at + 8 + length])
        if number == chosen and body:
            if kind == b"IHDR" and random.random() < 0.7:
                struct.pack_into(">I", body, random.choice([0, 4]), random.choice([0, 1, 7, 65535, 100000, 2**31 - 1, 2**32 - 1]))
            else:
                body[random.randrange(len(body))] ^= 1 << random.randrange(8)
        out += struct.pack(">I", len(body)) + kind + bytes(body) + struct.pack(">I", zlib.crc32(kind + bytes(body)))
        at += 12 + length
        number += 1
    return out


def field(data, random):
    """A binary number of 2, 4 or 8 bytes is at a limit."""
    size = random.choice([2, 4, 8])
    if len(data) < size:
        return noise(data, random)
    at = random.randrange(min(len(data) - size + 1, 4096))
    value = random.choice([0, 1, 2**(8 * size) - 1, 2**(8 * size - 1), 2**(8 * size - 1) - 1])
    return data[:at] + value.to_bytes(size, random.choice(["little", "big"])) + data[at + size:]


def sums(data):
    """An event log's checksums made right again: else no change would get past them."""
    out, at = bytearray(data), 8
    while at + 8 <= len(out):
        length = int.from_bytes(out[at:at + 4], "little")
        if length > len(out) - at - 8:
            break
        out[at + 4:at + 8] = zlib.crc32(bytes(out[at + 8:at + 8 + length])).to_bytes(4, "little")
        at += 8 + length
    return bytes(out)


TEXT = [bits, noise, zeros, missing, twice, cut, empty, longer, lines, lines, lines,
        replaced(NUMBER, NUMBERS), replaced(NUMBER, NUMBERS), replaced(NUMBER, NUMBERS), replaced(NUMBER, NUMBERS),
        replaced(STAMP, STAMPS), replaced(STAMP, STAMPS), replaced(WORD, WORDS), replaced(WORD, WORDS)]
BINARY = [bits, bits, noise, zeros, missing, twice, cut, cut, empty, field, field, field, chunk, chunk]
BINARY_ENDINGS = (".png", ".jpg", ".avi", ".pgm", ".wmlog", ".wmmap")


def mutate(name, data, random):
    """The bytes of the file `name`, changed by one mutation, or by three."""
    kinds = BINARY if name.endswith(BINARY_ENDINGS) else TEXT
    for _ in range(random.choice([1, 1, 1, 3])):
        data = random.choice(kinds)(data, random)
    return sums(data) if name.endswith(".wmlog") and random.random() < 0.8 else data
