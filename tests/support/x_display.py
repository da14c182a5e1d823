"""The beginning of the X protocol, without libraries: enough to see whether a display lets somebody in.

It is a text, since simulations run it as well: `exec(X_DISPLAY)`.
"""

X_DISPLAY = r'''
import os, socket, struct

def display_key(path):
    """The password in the first entry of an authority file."""
    with open(path, "rb") as file:
        file.read(2)
        return [file.read(struct.unpack(">H", file.read(2))[0]) for _ in range(4)][3]

def enter_display(address, key):
    """Whether the X server at a socket takes us as its client with this password; OSError when there is none."""
    name = b"MIT-MAGIC-COOKIE-1" if key else b""
    padded = lambda text: text + bytes(-len(text) % 4)
    with socket.socket(socket.AF_UNIX) as end:
        end.settimeout(10)
        end.connect(address)
        end.sendall(struct.pack("<BxHHHHxx", ord("l"), 11, 0, len(name), len(key)) + padded(name) + padded(key))
        try:
            return end.recv(1) == b"\x01"
        except ConnectionResetError:  # it refuses so quickly that its answer is lost
            return False

def own_display():
    """The socket of the display that we are given, and its password."""
    number = os.environ["DISPLAY"].partition(":")[2].partition(".")[0]
    return "/tmp/.X11-unix/X" + number, display_key(os.environ["XAUTHORITY"])
'''
