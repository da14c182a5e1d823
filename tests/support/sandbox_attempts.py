"""What a hostile project tries against its server, its neighbours and the machine: one function for each attempt.

This file is used twice. The tests read from it which attempts there are, what has to come of them in a sandbox, and to which row of the
table in docs/sandboxes.md they belong. A copy of it lies beside the hostile controller, which calls the functions inside of the sandbox.
So it imports nothing but Python's own library.

The outcome of an attempt is "done", the name of the error that forbade it, or a word of its own. An attempt is told its target; where the
machine that tests has no such thing the target is None, and nothing is tried.
"""

import ctypes
import errno
import fcntl
import mmap
import os
import select
import signal
import socket
import struct
import subprocess
import termios
import time

ROWS = {
    "files": "read the server's configuration, keys and logs, `/etc/shadow`, home folders",
    "neighbour": "read or change the project of another simulation",
    "write": "write anywhere but in its own project and a private `/tmp`",
    "see": "see processes of others",
    "signal": "signal, stop or kill its server, its guard or other simulations",
    "trace": "trace processes of others, or read their memory, environment and root folder",
    "services": "connect to services of this machine, by the loopback, its own address, or the gateway and the resolver that it is given",
    "abstract": "connect to abstract sockets of this machine, as X servers have",
    "operator": "speak to its server over the operator's socket",
    "private": "connect to private, shared and link-local addresses, the metadata service of a cloud among them",
    "public": "connect to public addresses",
    "raw": "send raw packets, or enter another root folder",
    "routes": "change interfaces and routes",
    "displays": "see the X displays of others, or connect to them",
    "terminal": "type into the operator's terminal (`TIOCSTI`)",
    "terminal_output": "write to the operator's terminal",
    "outlive": "outlive its session (`setsid`, double fork)",
    "capabilities": "have capabilities",
    "control_group": "leave its control group, or change what that limits",
    "set_user_id": "gain privileges by set-user-ID programs",
    "user_namespaces": "make user namespaces of its own",
    "mounts": "mount, unmount, make or enter other namespaces, or open files by their handles",
    "kernel": "write the kernel's settings (`/proc/sys`, `/sys`), its log, or disks",
    "keyring": "read keys of the server's session keyring",
    "rare": "use what the kernel offers everybody and hardly anybody needs: io_uring, userfaultfd, performance counters, the kernel's log, "
            "sockets of virtual machines and of cryptography, 32-bit system calls",
    "calls": "make devices, read physical memory, load modules or BPF programs, set the clock, reboot",
}

ATTEMPTS = {}
DONE = "done"
NOT_HERE = "there is no such thing on this machine"


class Attempt:
    """A function that `@attempt` has made a row of."""

    def __init__(self, row, refusals, writes, function):
        self.id = function.__name__
        self.title = function.__doc__
        self.row = row
        self.refusals = refusals  # what must come of it in a sandbox: one of these
        self.writes = writes  # whether its target is a file or a terminal, so that only what others see counts
        self.function = function


def attempt(row, *refusals, writes=False):
    """Registers a function as an attempt that has to be refused for one of these reasons."""
    assert row in ROWS and refusals

    def register(function):
        assert function.__name__ not in ATTEMPTS and function.__doc__
        ATTEMPTS[function.__name__] = Attempt(row, refusals, writes, function)
        return function

    return register


def outcome(name, target):
    """Tries it, in a process of its own so that nothing of it is left, for ten seconds at most."""
    if target is None:
        return NOT_HERE
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            said = ATTEMPTS[name].function(target) or DONE
        except OSError as error:
            said = errno.errorcode.get(error.errno, "timed out" if isinstance(error, TimeoutError) else str(error))
        except Exception as error:  # pylint: disable=broad-except
            said = repr(error)
        os.write(writer, said.encode())
        os._exit(0)
    os.close(writer)
    said = os.read(reader, 1000).decode() if select.select([reader], [], [], 10)[0] else "hung"
    os.close(reader)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return said or "ended at once"


# What the attempts need of the system.

LIBC = ctypes.CDLL(None, use_errno=True)
NUMBERS = {"x86_64": {"add_key": 248, "keyctl": 250, "bpf": 321, "userfaultfd": 323, "perf_event_open": 298, "kexec_load": 246,
                      "open_by_handle_at": 304, "finit_module": 313},
           "aarch64": {"add_key": 217, "keyctl": 219, "bpf": 280, "userfaultfd": 282, "perf_event_open": 241, "kexec_load": 104,
                       "open_by_handle_at": 265, "finit_module": 273}}.get(os.uname().machine, {})
NUMBERS.update(io_uring_setup=425, fsopen=430)  # the same everywhere


def checked(result):
    """The result of a system call, or its error."""
    if result < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


def system_call(name, *arguments):
    if name not in NUMBERS:
        raise OSError(errno.ENOSYS, name)
    whole = [ctypes.c_long(each) if isinstance(each, int) else each for each in (NUMBERS[name], *arguments)]
    return checked(LIBC.syscall(*whole))


def read(path):
    with open(path, "rb") as file:
        file.read(1)


def append(path):
    with open(path, "a") as file:
        file.write("x")


def open_for_writing(path):
    os.close(os.open(path, os.O_WRONLY | os.O_NONBLOCK))


def any_of(function, targets):
    """Succeeds with the first target with which the function does; or else fails as it does with the last one."""
    for each in targets[:-1]:
        try:
            return function(each)
        except OSError:
            pass
    return function(targets[-1])


def connect(address):
    """TCP, until something answers or refuses."""
    with socket.create_connection(address, 3):
        pass


def identity(process):
    """Its program and when it was started, which tell it from another one that has the same number in another namespace."""
    with open(f"/proc/{process}/stat") as stat:
        name, _, rest = stat.read().rpartition(")")
    return name.partition("(")[2] + " " + rest.split()[19]


def require_it(victim):
    """ESRCH where a process with this number is not the victim."""
    try:
        found = identity(victim[0]) == victim[1]
    except FileNotFoundError:
        return  # as the caller will see, unless just /proc is in its way
    if not found:
        raise OSError(errno.ESRCH, "another process")


# Files.

@attempt("files", "ENOENT")
def read_shadow(path):
    """`/etc/shadow`"""
    read(path)


@attempt("files", "ENOENT")
def read_configuration(path):
    """the server's configuration"""
    read(path)


@attempt("files", "ENOENT")
def read_key(path):
    """the key of its certificate"""
    read(path)


@attempt("files", "ENOENT")
def read_log(path):
    """its log"""
    read(path)


@attempt("files", "ENOENT")
def read_home(path):
    """a file in the home folder of the server's user"""
    read(path)


@attempt("files", "ENOENT")
def read_state(path):
    """a file of the server's state"""
    read(path)


@attempt("files", "ENOENT")
def read_by_link(path):
    """the configuration, by a symbolic link in its own project"""
    os.symlink(path, "link")
    try:
        read("link")
    finally:
        os.unlink("link")


@attempt("files", "ENOENT")
def hard_link(path):
    """the configuration, by a hard link in its own project"""
    os.link(path, "hard_link")
    os.unlink("hard_link")


@attempt("trace", "ENOENT")
def read_through_server(victim):
    """the configuration, through the root folder of the server's process"""
    if identity(victim[0]) != victim[1]:
        raise OSError(errno.ENOENT, "another process")
    read(f"/proc/{victim[0]}/root{victim[2]}")


@attempt("neighbour", "ENOENT")
def read_neighbour(path):
    """a file of the neighbour's project"""
    read(path)


@attempt("neighbour", "ENOENT", "EROFS", writes=True)
def write_neighbour(path):
    """change a file of the neighbour's project"""
    append(path)


@attempt("write", "ENOENT", "EROFS", "private", writes=True)
def write_server_folder(path):
    """a file beside the server's configuration"""
    append(path)


@attempt("write", "ENOENT", "EROFS", "private", writes=True)
def write_instances(path):
    """a file beside its own project"""
    append(path)


@attempt("write", "ENOENT", "EROFS", "private", writes=True)
def write_usr(path):
    """a file in `/usr`"""
    append(path)


@attempt("write", "ENOENT", "EROFS", "private", writes=True)
def write_etc(path):
    """a file in `/etc`"""
    append(path)


@attempt("write", "ENOENT", "EROFS", "private", writes=True)
def write_temporary(path):
    """a file in the machine's `/tmp`"""
    append(path)


# Processes. A victim is its number, its identity, and more.

@attempt("see", "unseen")
def see_processes(victims):
    """list processes of others"""
    for process, its_identity in victims:
        try:
            if identity(process) == its_identity:
                return DONE
        except FileNotFoundError:
            pass
    return "unseen"


@attempt("signal", "ESRCH")
def signal_server(victim):
    """signal the server"""
    require_it(victim)
    os.kill(victim[0], 0)


@attempt("signal", "ESRCH")
def stop_neighbour(victim):
    """stop the neighbour's simulator (`SIGSTOP`)"""
    require_it(victim)
    os.kill(victim[0], signal.SIGSTOP)
    os.kill(victim[0], signal.SIGCONT)


@attempt("signal", "ESRCH")
def signal_neighbours_guard(victim):
    """signal the neighbour's guard"""
    require_it(victim)
    os.kill(victim[0], 0)


@attempt("signal", "ESRCH")
def signal_own_guard(victim):
    """signal its own guard"""
    require_it(victim)
    os.kill(victim[0], 0)


@attempt("signal", "ESRCH")
def open_pidfd(victim):
    """get hold of the neighbour's simulator (`pidfd_open`)"""
    require_it(victim)
    os.close(os.pidfd_open(victim[0]))


@attempt("trace", "ESRCH")
def trace_neighbour(victim):
    """trace the neighbour's simulator"""
    require_it(victim)
    attach, detach = 16, 17
    checked(LIBC.ptrace(attach, victim[0], None, None))
    LIBC.waitpid(victim[0], None, 0x40000000)
    LIBC.ptrace(detach, victim[0], None, None)


@attempt("trace", "ESRCH")
def trace_own_guard(victim):
    """trace its own guard"""
    require_it(victim)
    checked(LIBC.ptrace(0x4206, victim[0], None, None))  # seize


@attempt("trace", "ESRCH")
def read_memory(victim):
    """read the memory of the neighbour's simulator (`process_vm_readv`)"""
    require_it(victim)
    buffer = ctypes.create_string_buffer(8)
    local = struct.pack("PN", ctypes.addressof(buffer), 8)
    remote = struct.pack("PN", victim[2], 8)
    checked(LIBC.process_vm_readv(victim[0], local, 1, remote, 1, 0))


@attempt("trace", "ENOENT")
def open_memory(victim):
    """open the memory of the neighbour's simulator (`/proc`)"""
    if identity(victim[0]) != victim[1]:
        raise OSError(errno.ENOENT, "another process")
    read(f"/proc/{victim[0]}/mem")


@attempt("trace", "ENOENT")
def read_environment(victim):
    """read the environment of the server"""
    if identity(victim[0]) != victim[1]:
        raise OSError(errno.ENOENT, "another process")
    read(f"/proc/{victim[0]}/environ")


# The network.

@attempt("services", "ECONNREFUSED")
def connect_loopback(address):
    """a service on the loopback"""
    connect(address)


@attempt("services", "ECONNREFUSED", "EADDRNOTAVAIL", "ENETUNREACH", "EHOSTUNREACH")
def connect_ipv6_loopback(address):
    """a service on the loopback, by IPv6"""
    connect(address)


@attempt("services", "ECONNREFUSED")
def connect_server(address):
    """the server, on the loopback"""
    connect(address)


@attempt("services", "ECONNREFUSED")
def connect_neighbour(address):
    """the neighbour's simulator, on the loopback"""
    connect(address)


@attempt("services", "EHOSTUNREACH", "ENETUNREACH")
def connect_own_address(address):
    """the server, by the machine's own address"""
    connect(address)


@attempt("services", "EHOSTUNREACH", "ENETUNREACH", "ECONNREFUSED")
def connect_gateway(address):
    """the server, through the gateway"""
    connect(address)


@attempt("services", "EHOSTUNREACH", "ENETUNREACH", "ECONNREFUSED")
def connect_resolver(address):
    """the server, through the resolver"""
    connect(address)


@attempt("operator", "ENOENT")
def ask_as_operator(path):
    """the operator's socket"""
    with socket.socket(socket.AF_UNIX) as end:
        end.connect(path)
        end.settimeout(5)
        try:
            end.sendall(b"GET /api/decisions HTTP/1.1\r\nHost: localhost\r\n\r\n")
            return DONE if end.recv(1) else "refused"
        except ConnectionError:
            return "refused"


@attempt("abstract", "ECONNREFUSED")
def connect_abstract(name):
    """an abstract socket"""
    with socket.socket(socket.AF_UNIX) as end:
        end.connect("\0" + name)


@attempt("private", "EHOSTUNREACH", "ENETUNREACH")
def connect_private(address):
    """another machine by its private address"""
    connect(address)


@attempt("private", "EHOSTUNREACH", "ENETUNREACH")
def connect_shared(address):
    """another machine by a shared address"""
    connect(address)


@attempt("private", "EHOSTUNREACH", "ENETUNREACH")
def connect_metadata(address):
    """the metadata service of a cloud"""
    connect(address)


@attempt("private", "EHOSTUNREACH", "ENETUNREACH")
def send_private_datagram(address):
    """another machine by UDP"""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        end.sendto(b"x", tuple(address))


@attempt("public", "EHOSTUNREACH", "ENETUNREACH")
def connect_public(address):
    """a public address"""
    connect(address)


@attempt("raw", "EPERM", "EAFNOSUPPORT")
def open_packet_socket(_):
    """a packet socket"""
    socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0).close()


@attempt("raw", "EPERM")
def open_raw_socket(_):
    """a raw socket"""
    socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP).close()


@attempt("routes", "EPERM")
def change_interface(_):
    """take an interface down and up again"""
    get_flags, set_flags = 0x8913, 0x8914
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        request = fcntl.ioctl(end, get_flags, struct.pack("16sH22x", b"lo", 0))
        fcntl.ioctl(end, set_flags, request)


@attempt("routes", "EPERM")
def change_route(_):
    """add a route"""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        address = struct.pack("=HH4s8x", socket.AF_INET, 0, bytes((10, 99, 99, 99)))
        mask = struct.pack("=HH4s8x", socket.AF_INET, 0, bytes((255, 255, 255, 255)))
        gateway = struct.pack("=HH4s8x", socket.AF_INET, 0, bytes(4))
        device = ctypes.create_string_buffer(b"lo")
        # struct rtentry: route up, to one host, over this device
        request = struct.pack("@L16s16s16sHhLPhPLLH6x", 0, address, gateway, mask, 0x5, 0, 0, 0, 0, ctypes.addressof(device), 0, 0, 0)
        fcntl.ioctl(end, 0x890B, request)
        fcntl.ioctl(end, 0x890C, request)


# The display and the terminal.

@attempt("displays", "unseen")
def see_displays(socket_of_another):
    """list the sockets of X servers"""
    folder, name = os.path.split(socket_of_another)
    return DONE if os.path.isdir(folder) and name in os.listdir(folder) else "unseen"


@attempt("displays", "ENOENT", "ECONNREFUSED")
def connect_display(path):
    """the socket of an X server"""
    with socket.socket(socket.AF_UNIX) as end:
        end.connect(path)


@attempt("terminal", "ENXIO", writes=True)
def type_into_terminal(_):
    """the terminal from which the server was started (`TIOCSTI`)"""
    terminal = os.open("/dev/tty", os.O_RDWR)
    fcntl.ioctl(terminal, termios.TIOCSTI, b"x")


@attempt("terminal_output", "ENOENT", writes=True)
def write_to_terminal(path):
    """the same terminal, by its name"""
    terminal = os.open(path, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
    os.write(terminal, b"x")


# Its session and its privileges.

@attempt("outlive", "ended")
def outlive(mark):
    """a process that leaves its parents"""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            for each in range(3, 256):
                try:
                    os.close(each)
                except OSError:
                    pass
            os.execv("/bin/sleep", ["sleep", mark])
        os._exit(0)


@attempt("capabilities", "none")
def have_capabilities(_):
    """capabilities"""
    with open("/proc/self/status") as status:
        sets = dict(line.split(":", 1) for line in status)
    return "none" if all(int(sets[each], 16) == 0 for each in ("CapPrm", "CapEff", "CapInh", "CapAmb")) else DONE


@attempt("control_group", "ENOENT", "EROFS", "EACCES")
def leave_group(lists_of_processes):
    """the one above it, or that of all processes"""
    def enter(path):
        with open(path, "wb", buffering=0) as processes:
            processes.write(b"0")

    any_of(enter, lists_of_processes)


@attempt("control_group", "ENOENT", "EROFS", "EACCES")
def raise_limits(limits):
    """the limits of its own"""
    any_of(open_for_writing, limits)


@attempt("control_group", "ENOENT", "EROFS", "EACCES", "EPERM")
def run_as_agent(path):
    """the program that the kernel runs when a group is empty (`release_agent`)"""
    with open(path, "r+b", buffering=0) as agent:
        agent.write(agent.read() or b"\n")


@attempt("control_group", "EPERM")
def mount_groups(_):
    """a mount of all groups"""
    def mount_them(kind_and_options):
        kind, options = kind_and_options
        checked(LIBC.mount(b"none", b"groups", kind, 0, options))
        checked(LIBC.umount(b"groups"))

    os.makedirs("groups", exist_ok=True)
    any_of(mount_them, ((b"cgroup2", None), (b"cgroup", b"memory"), (b"cgroup", b"pids")))


@attempt("control_group", "EPERM")
def make_group_namespace(_):
    """a namespace of control groups"""
    checked(LIBC.unshare(0x02000000))


@attempt("set_user_id", "no new ones")
def run_set_user_id(path):
    """a set-user-ID program"""
    def privileges(process):
        with open(f"/proc/{process}/status") as status:
            return [line for line in status if line.startswith(("Uid:", "CapPrm:"))]

    own = privileges("self")
    program = subprocess.Popen([path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    its = privileges(program.pid)
    program.kill()
    program.wait()
    return "no new ones" if own == its else DONE


@attempt("user_namespaces", "ENOSPC", "EPERM")
def make_user_namespace(_):
    """a user namespace"""
    checked(LIBC.unshare(0x10000000))


@attempt("mounts", "EPERM")
def make_mount_namespace(_):
    """a mount namespace"""
    checked(LIBC.unshare(0x00020000))


@attempt("mounts", "EPERM")
def mount(_):
    """mount"""
    os.makedirs("mounted", exist_ok=True)
    checked(LIBC.mount(b"none", b"mounted", b"tmpfs", 0, None))
    checked(LIBC.umount(b"mounted"))


@attempt("mounts", "EPERM")
def mount_in_new_way(_):
    """mount (`fsopen`)"""
    os.close(system_call("fsopen", ctypes.c_char_p(b"tmpfs"), 0))


@attempt("mounts", "EPERM", "EINVAL")
def unmount_proc(_):
    """unmount `/proc`"""
    checked(LIBC.umount2(b"/proc", 2))


@attempt("raw", "EPERM")
def change_root(_):
    """`chroot`"""
    os.chroot(".")


@attempt("mounts", "EPERM")
def enter_namespace(_):
    """enter a namespace of its first process (`setns`)"""
    namespace = os.open("/proc/1/ns/mnt", os.O_RDONLY)
    checked(LIBC.setns(namespace, 0))


@attempt("mounts", "EPERM")
def open_by_handle(_):
    """open files by their handles (`open_by_handle_at`)"""
    handle = struct.pack("Ii8s", 8, 1, struct.pack("Ii", 2, 0))
    folder = os.open("/", os.O_RDONLY)
    os.close(system_call("open_by_handle_at", folder, ctypes.c_char_p(handle), os.O_RDONLY))


# The kernel.

@attempt("kernel", "EROFS", "EACCES", "ENOENT")
def write_core_pattern(path):
    """the program that gets core dumps"""
    open_for_writing(path)


@attempt("kernel", "EROFS", "EACCES", "ENOENT")
def write_sysrq(path):
    """`sysrq-trigger`"""
    open_for_writing(path)


@attempt("kernel", "EROFS", "EACCES", "ENOENT")
def write_sys(path):
    """`/sys`"""
    open_for_writing(path)


@attempt("kernel", "ENOENT")
def write_disk(path):
    """a disk"""
    open_for_writing(path)


@attempt("kernel", "ENOENT")
def write_kernel_log(path):
    """the kernel's log"""
    open_for_writing(path)


@attempt("calls", "ENOENT")
def read_physical_memory(path):
    """`/dev/mem`"""
    read(path)


@attempt("calls", "EPERM")
def make_device(numbers):
    """a device file of its own"""
    os.mknod("disk", 0o60600, os.makedev(*numbers))
    os.unlink("disk")


@attempt("calls", "EPERM", "ENOSYS")
def load_module(_):
    """load a module"""
    system_call("finit_module", -1, ctypes.c_char_p(b""), 0)


@attempt("calls", "EPERM", "ENOSYS")
def load_kernel(_):
    """load another kernel"""
    system_call("kexec_load", 0, 0, None, 0)


@attempt("calls", "EPERM")
def load_bpf(_):
    """load a BPF program"""
    code = struct.pack("<BBhiBBhi", 0xB7, 0, 0, 0, 0x95, 0, 0, 0)
    license_name = b"GPL\0"
    code_buffer, license_buffer = ctypes.create_string_buffer(code), ctypes.create_string_buffer(license_name)
    tracepoint = 5
    attributes = struct.pack("IIQQIIQI", tracepoint, 2, ctypes.addressof(code_buffer), ctypes.addressof(license_buffer), 0, 0, 0, 0)
    attributes += bytes(128 - len(attributes))
    os.close(system_call("bpf", 5, ctypes.c_char_p(attributes), len(attributes)))


@attempt("calls", "EPERM")
def set_clock(_):
    """set the clock"""
    time.clock_settime(time.CLOCK_REALTIME, time.clock_gettime(time.CLOCK_REALTIME))


@attempt("calls", "EPERM")
def reboot(_):
    """reboot (with Ctrl-Alt-Del, which is only switched on)"""
    checked(LIBC.reboot(0x89ABCDEF))


@attempt("calls", "EPERM")
def set_host_name(name):
    """the machine's name"""
    checked(LIBC.sethostname(name.encode(), len(name)))


@attempt("keyring", "EPERM")
def read_key_of_session(description):
    """the session keyring"""
    session, search, read_payload = -3, 10, 11
    key = system_call("keyctl", search, session, ctypes.c_char_p(b"user"), ctypes.c_char_p(description.encode()), 0)
    buffer = ctypes.create_string_buffer(100)
    system_call("keyctl", read_payload, key, buffer, len(buffer))


@attempt("rare", "EPERM")
def use_io_uring(_):
    """io_uring"""
    os.close(system_call("io_uring_setup", 1, ctypes.create_string_buffer(120)))


@attempt("rare", "EPERM")
def use_userfaultfd(_):
    """userfaultfd"""
    user_mode_only = 1
    os.close(system_call("userfaultfd", user_mode_only))


@attempt("rare", "EPERM")
def count_performance(_):
    """performance counters"""
    software, task_clock, exclude_kernel_and_hypervisor = 1, 1, 3 << 5
    attributes = struct.pack("IIQQQQQ", software, 64, task_clock, 0, 0, 0, exclude_kernel_and_hypervisor) + bytes(16)
    os.close(system_call("perf_event_open", ctypes.c_char_p(attributes), 0, -1, -1, 0))


@attempt("rare", "EPERM")
def read_kernel_log(_):
    """the kernel's log"""
    read_all = 3
    checked(LIBC.klogctl(read_all, ctypes.create_string_buffer(100), 100))


@attempt("rare", "EAFNOSUPPORT")
def open_vsock(_):
    """sockets of virtual machines"""
    socket.socket(socket.AF_VSOCK, socket.SOCK_STREAM).close()


@attempt("rare", "EAFNOSUPPORT")
def open_crypto_socket(_):
    """sockets of cryptography"""
    socket.socket(socket.AF_ALG, socket.SOCK_SEQPACKET).close()


@attempt("rare", "ENOSYS")
def call_with_32_bits(_):
    """32-bit system calls"""
    getpid = b"\xb8\x14\x00\x00\x00\xcd\x80\xc3"  # mov eax, 20; int 0x80; ret
    memory = mmap.mmap(-1, len(getpid), prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)
    memory.write(getpid)
    code = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    said = ctypes.CFUNCTYPE(ctypes.c_int)(code)()
    if said < 0:
        raise OSError(-said, os.strerror(-said))
