"""The environments of tests/environments.py, a row each. All is bash, in a network, processes, mounts and a /tmp of the row's own.

These are known in there besides bash: `listen ADDRESS PORT` (somebody else has that port), `set_key FILE KEY JSON`, `without PROGRAM...` (not
installed), `as_user COMMAND` (with the row's user, in the checkout), `certificate ARGUMENTS OF openssl x509` (in tls/), `get ADDRESS`, `log`
(what both servers have logged). `{}` is what people type: ./server.sh with a verb. $STARTED is what the start has printed.
"""

import dataclasses

SESSION, SIMULATION = "config/session/local.json", "config/simulation/local.json"


@dataclasses.dataclass
class Row:
    """A machine that is unlike the one of the developers, what is typed there, and what has to come of it."""

    name: str
    says: str = ""  # the start is refused, and this is in its first sentence (a regular expression). Without it the site has to work
    warns: str = ""  # the servers are started, but nobody can start a simulation, and this is in the first sentence
    tells: str = ""  # this is somewhere in what a start prints that works
    before: str = ""  # as root, in the checkout
    typed: str = "{}"
    config: str = ""  # the name of a configuration, and more arguments of the start
    user: str = "ada"  # who types it: ada, root, nobody, or a number that has no name
    check: str = ""  # as root, while the site works: fails, or prints what is wrong
    after: str = ""  # the same once the start was refused
    folder: str = "site"  # of the checkout
    others_run: bool = False  # servers that were there before a refused start
    silent: bool = False  # nothing that is printed can be read
    needs: tuple = ()  # programs of this machine


def refused(name, says, before="", **more):
    return Row(name, says, before=before, **more)


def broken(name, says, file, change, **more):
    """A configuration that people have changed; `change` is a filter."""
    return Row(name, says, before=f"{change} <{file} >/tmp/changed; cat /tmp/changed >{file}", **more)


PLAIN = [
    Row("nothing is odd", check='! grep -E "\\[(warning|error)" <<<"$(log)" | grep -v "sandbox\\|control group\\|Load\\|busy\\|local:"'),
    Row("root starts it", user="root"),
    Row("a user whose number has no name", user="1234", typed="env -u USER -u LOGNAME {}"),
    Row("the user nobody", user="nobody", typed="HOME=/nonexistent {}"),
    Row("the log tells an orderly end and its cause", check='as_user ./server.sh stop >/dev/null; log | grep -q "Ending, as SIGTERM asks"; '
        "as_user ./server.sh start >/dev/null"),
    Row("both are killed with SIGKILL, then started again", check='kill -9 $(cat log/.session.pid log/.simulation.pid); '
        "sleep 0.2; as_user ./server.sh start | grep -q ^Open"),
    Row("a user of a directory service, whose number is large", user="1878000001"),
    Row("cron starts it", typed="env -i HOME=$HOME LOGNAME=$LOGNAME PATH=/usr/bin:/bin SHELL=/bin/sh /bin/sh -c '{}'"),
    Row("typed over ssh: the command returns when it is done", typed="timeout 60 {} 2>&1 | cat; exit ${PIPESTATUS[0]}"),
    Row("typed with nohup", typed="nohup {} >/tmp/nohup; cat /tmp/nohup"),
    Row("the programs are replaced while it runs", before="umount build/release/bin; cp -a $BIN/. build/release/bin; chown -R ada build",
        check="cd build/release/bin; for each in webots-*; do cp $each .new; mv .new $each; done; cd - >/dev/null; "
        "as_user ./server.sh status | grep -q 'session server runs'; as_user ./server.sh restart | grep -q ^Open"),
]

SCRIPT = [
    Row("sh server.sh", typed="sh {}"),
    Row("bash -x", typed="bash -x {} 2>/dev/null"),
    Row("a link to the script", before="ln -s $PWD/server.sh /tmp/site", typed="cd /; /tmp/site $VERB"),
    Row("typed in another folder", typed="cd /; $OLDPWD/{}"),
    Row("the folder in which it is typed is gone", typed="here=$PWD; mkdir /tmp/gone; cd /tmp/gone; rmdir /tmp/gone; $here/{}"),
    Row("a checkout with Windows' line ends", before="as_user bash -c 'git init -q . && git add -A && git -c user.name=a -c user.email=a@b "
        "commit -qm a && git clone -q -c core.autocrlf=true . /tmp/clone'; cp /tmp/clone/server.sh server.sh && cp /tmp/clone/cmake/packages/*.* cmake/packages",
        needs=("git",)),
    Row("the folder log is removed while it runs", check='rm -rf log; as_user ./server.sh status | grep -q "session server runs" && '
        'as_user ./server.sh start | grep -q "already running"'),
    Row("the folder log is replaced while it runs: the doctor says so", check="mv log old; mkdir -p log; chown ada log; "
        "said=$(as_user build/release/bin/webots-session-server --doctor config/session/local.json || true); "
        "grep -Eiq 'log.*(gone|replaced|removed|deleted|no longer|moved away)' <<<\"$said\" || echo \"$said\""),
    refused("a second checkout", "Port 1998 is in use by a website host of /srv/site \\(.*Stop it with /srv/site/server.sh stop", others_run=True,
            before="cp -a $PWD /srv/second; mkdir -p /srv/second/build/release/bin; mount --bind build/release/bin /srv/second/build/release/bin; "
            "as_user ./server.sh start >/dev/null", typed="cd /srv/second; {}"),
    refused("started as root before, and still running", "belongs to root", "./server.sh start >/dev/null", others_run=True),
    refused("started as root before, and stopped", "log.* belongs to root.*sudo chown -R ada: log",
            "./server.sh start >/dev/null; ./server.sh stop >/dev/null"),
    refused("a full disk at the first start", "disk full|No space",
            "mkdir log; mount -t tmpfs -o size=16k none log; chown ada log; dd if=/dev/zero of=log/filler 2>/dev/null || true",
            after="rm log/filler; mount -o remount,size=16m log; as_user ./server.sh start | grep -q ^Open"),
    refused("one server fails: the other is stopped again", "/proc/nowhere", "set_key config/session/local.json logDir '\"/proc/nowhere\"'"),
    Row("no ip, awk, getconf, hostname, ps, setsid", before="without ip awk gawk mawk getconf hostname ps setsid"),
    Row("no git, npm, node, curl, wget", before="without git npm node curl wget"),
    Row("no python3, qrencode, sudo, file", before="without sudo qrencode file python3.11"),
    refused("no cmake", "cmake", "umount /usr/bin/cmake; without cmake"),
    refused("no flock", "flock", "without flock"),
    Row("standard output is closed", typed="{} >&-", silent=True),
    Row("all standard files are closed", typed="{} <&- >&- 2>&-", silent=True),
    Row("nobody reads the output", typed="{} | true", silent=True),
    Row("the output's disk is full", typed="{} >/dev/full", silent=True),
    Row("both outputs' disk is full", typed="{} >/dev/full 2>&1", silent=True),
    Row("the shell ends at once (SIGHUP)", typed="setsid bash -c '{} ; kill -HUP $$' || true"),
    Row("signals are ignored where it is typed", typed="trap '' HUP INT TERM CHLD PIPE USR1; {}"),
    Row("an interrupted start leaves nothing", before="as_user timeout -s INT 0.3 ./server.sh start >/dev/null || true; "
        "for i in $(seq 100); do pgrep '^webots-s' >/dev/null || break; sleep 0.1; done; ! pgrep '^webots-s'"),
    Row("a start beside a start", typed="{} >/tmp/other & {}; wait"),
    Row("CDPATH is set", typed="CDPATH=/tmp:/ {}"),
    Row("BASH_ENV prints", before="echo 'echo hello; echo oops >&2' >/tmp/env", typed="BASH_ENV=/tmp/env {}"),
    Row("POSIXLY_CORRECT and an odd IFS", typed="POSIXLY_CORRECT=1 IFS=abc {}"),
    Row("an empty environment", typed="env -i {}"),
    Row("PATH is only /usr/bin", typed="PATH=/usr/bin {}"),
    Row("PATH begins with the working folder", before="printf '#!/bin/sh\\nexit 1\\n' >readlink2; chmod +x readlink2", typed="PATH=.:$PATH {}"),
    Row("GREP_OPTIONS and aliases for colours", typed="GREP_OPTIONS=--color=always GREP_COLORS='mt=1' LS_COLORS=x {}"),
    Row("1 MB of environment", typed="export A=$(head -c 100000 /dev/zero | tr '\\0' a) B=$(head -c 100000 /dev/zero | tr '\\0' b); {}"),
    Row("a preloaded library that is not there", typed="LD_PRELOAD=/nowhere.so {}"),
    Row("an interpreter of somebody else's Python", typed="PYTHONHOME=/nowhere PYTHONPATH=/nowhere {}"),
    Row("a terminal of 20 columns", typed="script -qec 'stty cols 20 rows 5; {}' /dev/null </dev/null | tr -d '\\r'", needs=("script",)),
    Row("a second checkout at other ports, beside the first", config="local --port 3000", tells="Open http://localhost:3000/", before="cp -a $PWD /srv/first; "
        "mkdir -p /srv/first/build/release/bin; mount --bind build/release/bin /srv/first/build/release/bin; (cd /srv/first; as_user true; cd /srv/first; "
        "setpriv --reuid=1001 --regid=1001 --clear-groups env HOME=/home/ada ./server.sh start >/dev/null)",
        check="cd /srv/first; setpriv --reuid=1001 --regid=1001 --clear-groups env HOME=/home/ada ./server.sh stop >/dev/null"),
]

FOLDERS = [Row(f"the folder {name!r}", folder=name) for name in (
    "webots_cloud (1)", "it's", "a&b", "-rf", "täst 日本", "a  b ", "$HOME", "%s%n", "back`tick", "new\nline", "a=b", "~", "x" * 200,
    "/".join(["deep"] * 40))] + [
    refused("a folder in which CMake can't build", "; in its path: .*Rename or move", folder="two;three"),
    Row("a linked checkout", before="ln -s $PWD /srv/link", typed="cd /srv/link; {}"),
    Row("a checkout that others may only read", before="chmod -R go-w .; mkdir log website; chown ada log website"),
    Row("root's own folder, which nobody else may enter", folder="/root/site", user="root", before="chmod 700 /root"),
    Row("a home that nobody else may enter", folder="/home/ada/site", before="chmod 700 /home/ada"),
    Row("the checkout is renamed while it runs", check="cd /srv; mv site renamed; cd renamed; FOLDER=$PWD; as_user ./server.sh status | grep -q 'session server runs'; "
        "as_user ./server.sh start | grep -q 'session server is already running'; as_user ./server.sh restart | grep -q ^Open; as_user ./server.sh stop >/dev/null; "
        "cd /srv; mv renamed site; cd site; FOLDER=$PWD; as_user ./server.sh start >/dev/null"),
    refused("a disk on which nothing may be run", "No program of /srv/site can be run: .*noexec", "mount --rbind . .; mount -o remount,noexec,bind .; true",
            typed="cd /; cd $OLDPWD; bash {}"),
    Row("the folder log is a link to another disk", before="mkdir /tmp/logs; chown ada /tmp/logs; ln -s /tmp/logs log"),
    Row("log is a file", before="touch log; chown ada log"),
    refused("a checkout that may not be written", "write there", before="chmod -R go-w . ; chown -R root ."),
    refused("a checkout on a read-only disk", "read-only|write there|can't be made",
            "mount --bind . .; mount -o remount,ro,bind .; true", typed="cd /; cd $OLDPWD; {}"),
    Row("a read-only system beside the checkout", before="mount -o remount,ro,bind / || { mount --rbind / /mnt; false; }"),
    Row("/tmp is noexec, nosuid, nodev", before="mount -o remount,noexec,nosuid,nodev /tmp"),
    Row("TMPDIR is not there", typed="TMPDIR=/tmp/nowhere {}"),
    Row("TMPDIR has a blank", before="mkdir '/tmp/a b'; chmod 777 '/tmp/a b'", typed="TMPDIR='/tmp/a b' {}"),
    Row("/tmp can't be written", before="mount -o remount,ro /tmp"),
    Row("/tmp is full", before="mount -o remount,size=1m /tmp; dd if=/dev/zero of=/tmp/filler 2>/dev/null || true"),
    Row("no inodes in /tmp", before="mount -o remount,nr_inodes=2 /tmp; touch /tmp/a /tmp/b /tmp/c 2>/dev/null || true"),
    Row("the state disk is full: the start says what is weaker", tells="sandbox|disk|full",
        before="mkdir -p /home/ada/.local/state; mount -t tmpfs -o size=4k none /home/ada/.local/state; "
        "chown -R ada /home/ada; dd if=/dev/zero of=/home/ada/.local/state/filler 2>/dev/null || true"),
    Row("somebody else has /tmp/webots_cloud", before="mkdir -m 700 /tmp/webots_cloud", typed="HOME=/nowhere {}"),
    refused("somebody else has the folder of our state", "/tmp/webots-1001.* belongs to another user. Remove it, or set .stateDir.", "mkdir -m 700 /tmp/webots-1001",
            typed="HOME=/nowhere {}"),
    Row("/dev/shm is not there", before="umount /dev/shm"),
    Row("/run is not there", before="mount -o remount,ro,size=4k /run; umount -l /run; mount -t tmpfs -o ro none /run"),
    refused("/proc is not mounted", "without /proc.*mount -t proc proc /proc", "mount -t tmpfs none /proc"),
    refused("/proc hides others' processes", "hidepid.*Run this as root", "mount -o remount,hidepid=2 /proc"),
    refused("/proc hides what others do", "hidepid.*Run this as root", "mount -o remount,hidepid=1 /proc"),
    Row("/proc hides others' processes, but not from root", user="root", before="mount -o remount,hidepid=2 /proc"),
]

PEOPLE = [
    Row("no HOME", typed="env -u HOME {}"),
    Row("HOME is empty", typed="HOME= {}"),
    Row("HOME=/", typed="HOME=/ {}"),
    Row("root with HOME=/", user="root", typed="HOME=/ {}"),
    Row("HOME is not there", typed="HOME=/nowhere {}"),
    Row("HOME is a file", typed="touch /tmp/file; HOME=/tmp/file {}"),
    Row("folders of state and sockets with names of 150 letters", typed="here=/tmp/$(printf 'x%.0s' {1..150}); mkdir -m 700 $here; XDG_RUNTIME_DIR=$here XDG_STATE_HOME=$here XDG_CACHE_HOME=$here {}",
        check="grep -q '.sock: its path is too long' <<<\"$(log)\""),
    Row("root stops what a user has started", check="./server.sh stop | grep -q '^Stopped session'; as_user ./server.sh start | grep -q ^Open"),
    Row("another user types stop", check="said=$(setpriv --reuid=65534 --regid=65534 --clear-groups ./server.sh stop 2>&1 || true); [[ $said = *'belongs to ada'*'Run this as ada'* ]] || echo \"$said\""),
    Row("HOME can't be written", before="chown root /home/ada; chmod 755 /home/ada"),
    Row("HOME is relative", typed="HOME=home {}"),
    Row("HOME has a quote and a line end", typed="HOME=$'/tmp/it\\'s\\nhome'; mkdir \"$HOME\"; export HOME; {}"),
    Row("the folder of state is a file", typed="touch /tmp/file; XDG_STATE_HOME=/tmp/file XDG_CACHE_HOME=/tmp/file {}"),
    Row("HOME has blanks", before="mkdir '/home/a b'; chown ada '/home/a b'", typed="HOME='/home/a b' {}"),
    Row("XDG folders are relative", typed="XDG_STATE_HOME=state XDG_CACHE_HOME=cache XDG_RUNTIME_DIR=run {}"),
    Row("XDG_RUNTIME_DIR of somebody else (su)", before="mkdir -p -m 700 /run/user/0", typed="XDG_RUNTIME_DIR=/run/user/0 {}"),
    Row("umask 077", typed="umask 077; {}"),
    Row("root with umask 077", user="root", typed="umask 077; {}"),
    Row("umask 0", typed="umask 0; {}"),
    Row("all capabilities of root dropped", user="root", before="chown -R root .",
        typed="setpriv --bounding-set=-all --inh-caps=-all --ambient-caps=-all bash -c '{}'"),
    Row("no new privileges", typed="setpriv --no-new-privs {}"),
    Row("no user namespaces", before="", typed="unshare --user --map-current-user bash -c 'echo 0 >/proc/sys/user/max_user_namespaces; exec {}'"),
    Row("root of a user namespace", typed="unshare --user --map-root-user bash -c 'exec {}'"),
    Row("the simulation server is process 1", user="root", before="cat >/tmp/init <<'END'\n. /srv/words\nbuild/release/bin/webots-session-server config/session/local.json "
        ">/tmp/session 2>&1 &\nunshare --pid --fork --mount-proc build/release/bin/webots-simulation-server config/simulation/local.json >/tmp/simulation "
        "2>&1 &\nfor i in $(seq 20); do get http://localhost:1999/session 2>/dev/null | grep -q ^ws: && break; sleep 0.1; done\n"
        "echo Open http://localhost:1999/\nEND", typed="[[ $VERB = stop ]] && kill $(pgrep webots-s) || . /tmp/init"),
]

NETWORK = [
    Row("no IPv6", before="sysctl -qw net.ipv6.conf.all.disable_ipv6=1 net.ipv6.conf.lo.disable_ipv6=1"),
    Row("localhost is ::1 alone", before="echo '::1 localhost' >/tmp/hosts; mount --bind /tmp/hosts /etc/hosts"),
    Row("localhost is nowhere in /etc/hosts", before=": >/tmp/hosts; mount --bind /tmp/hosts /etc/hosts"),
    Row("no DNS", before=": >/tmp/resolv; mount --bind /tmp/resolv /etc/resolv.conf"),
    Row("a dead name server", before="echo nameserver 203.0.113.1 >/tmp/resolv; mount --bind /tmp/resolv /etc/resolv.conf"),
    Row("the host's name is unknown", before="hostname unknown.invalid"),
    Row("the host's name is odd", before="echo 'a_b(1)' >/proc/sys/kernel/hostname"),
    refused("the loopback is down", "loopback|network|127.0.0.1|not answer", "ip link set lo down"),
    refused("the loopback has no IPv4", "127.0.0.1 is none of this machine's addresses", "ip address delete 127.0.0.1/8 dev lo"),
    Row("no /etc/hosts and no /etc/resolv.conf", before="mkdir /tmp/etc; cp -a /etc/. /tmp/etc 2>/dev/null || true; rm -f /tmp/etc/hosts /tmp/etc/resolv.conf; mount --bind /tmp/etc /etc"),
    refused("ports below 3000 are for root", "port 1998: Permission denied. net.ipv4.ip_unprivileged_port_start", "sysctl -qw net.ipv4.ip_unprivileged_port_start=3000"),
    refused("somebody has all ports of simulations", "All ports of simulations, 2001 to 2100, are in use by other programs.* --port 2999","python3 -c '\nimport os, signal, socket\nheld = [socket.create_server((\"0.0.0.0\", port)) "
        "for port in range(2001, 2201)]\nif os.fork() == 0:\n    os.closerange(0, 3)\n    signal.pause()'"),
    refused("listenAddress is of another machine", "192.0.2.1 is none of this machine's addresses.*name one of them", f"set_key {SESSION} listenAddress '\"192.0.2.1\"'"),
    Row("a dead proxy in the environment", typed="http_proxy=http://127.0.0.1:9 https_proxy=http://127.0.0.1:9 all_proxy=socks5://127.0.0.1:9 {}"),
    Row("a proxy that is no address", typed="http_proxy='not an address' {}"),
    Row("an odd OpenSSL configuration", before="echo nonsense >/tmp/openssl", typed="OPENSSL_CONF=/tmp/openssl SSL_CERT_FILE=/nowhere {}"),
    *(refused(f"somebody has {port} of {address}", f"Port {port} is in use by another program.* --port ", f"listen {address} {port}")
      for address in ("127.0.0.1", "::1", "0.0.0.0", "::") for port in (1998, 1999, 2000)),
    *(Row(f"somebody has 2001 of {address}: simulations go elsewhere", before=f"listen {address} 2001") for address in ("127.0.0.1", "::1", "0.0.0.0", "::")),
    Row("somebody has 2000, and --port moves the site", before="listen 127.0.0.1 2000", config="local --port 3000", tells="Open http://localhost:3000/"),
    Row("outgoing connections may have our ports", before="sysctl -qw net.ipv4.ip_local_port_range='1024 65000'"),
    refused("TLS on 443 without privileges", "443.*(may|privilege|root|permi)", config="tls"),
    Row("TLS, and its first certificate", user="root", config="tls", tells="Made tls/certificate.pem"),
    refused("TLS without openssl", "without openssl: apt install openssl", "without openssl; sysctl -qw net.ipv4.ip_unprivileged_port_start=80", config="tls"),
    refused("TLS in a folder that may not be written", "tls.*(Permission|write)", "mkdir tls; sysctl -qw net.ipv4.ip_unprivileged_port_start=80", config="tls"),
    Row("TLS on 8443: addresses have the port", config="tls --port 8443", before="sysctl -qw net.ipv4.ip_unprivileged_port_start=80",
        tells="Open https://localhost:8443/", check="get https://localhost:8443/session | grep -qx wss://localhost:8443"),
    Row("the network has another address for us", before="ip address add 192.168.7.5/24 dev lo", config="lan",
        tells="From other machines of the network: http://192.168.7.5:1999/", check="get http://192.168.7.5:1999/session | grep -q ws://192.168.7.5:1999"),
    Row("a plain start serves this machine, or names it as it was asked for", before="ip address add 192.168.7.5/24 dev lo",
        check="said=$(get http://192.168.7.5:1999/session || echo none); [[ $said = none || $said = *192.168.7.5* || $said = *--lan* ]] || echo \"$said\""),
]

LOCALES = [Row(f"the locale {name}", typed=f"LC_ALL={name} LANG={name} {{}}") for name in (
    "C", "POSIX", "C.UTF-8", "tr_TR.UTF-8", "de_DE@euro", "ja_JP.EUC-JP", "nonsense", "en_US.UTF-8/../../x")] + [
    Row("LANGUAGE asks for German messages", typed="LANGUAGE=de LANG=C.UTF-8 {}"),
    Row("a time zone that is none", typed="TZ=Nowhere/Atlantis {}"),
    Row("no time zone of the machine", before="mount --bind /dev/null /etc/localtime", typed="env -u TZ {}"),
    *(Row(f"the clock is in {year}", typed=f"LD_PRELOAD=$FAKETIME_LIBRARY FAKETIME='@{year}-12-30 12:00:00' DONT_FAKE_MONOTONIC=1 {{}}", needs=("libfaketime",))
      for year in (1969, 1970, 2037, 2100)),
]

LIMITS = [
    Row("ulimit -n 256", typed="ulimit -n 256; {}"),
    Row("ulimit -n 100", typed="ulimit -n 100; {}"),
    refused("ulimit -n 20", "open files.*ulimit -n", typed="ulimit -n 20; {}"),
    Row("ulimit -n 1 million", user="root", typed="ulimit -n 1000000; {}"),
    Row("ulimit -v 2 GB", typed="ulimit -v 2000000; {}"),
    refused("ulimit -v 30 MB", "address space.*ulimit -v", typed="ulimit -v 30000; {}"),
    Row("ulimit -u 200", typed="ulimit -u 200; {}"),
    refused("ulimit -u 1", "process|thread|fork|Resource|ulimit", typed="ulimit -u 1; {}"),
    Row("ulimit -f 100 MB", typed="ulimit -f 100000; {}"),
    # Nor could what it says: somebody else writes that.
    refused("ulimit -f 0: nothing can be written", "logs .*written.*ulimit -f", typed="(ulimit -f 0; {} 2>&1) | cat >&2; exit ${PIPESTATUS[0]}"),
    Row("ulimit -s 512 kB", typed="ulimit -s 512; {}"),
    Row("ulimit -l 0, -c unlimited, -q 0", typed="ulimit -l 0; ulimit -q 0; ulimit -c unlimited 2>/dev/null; {}"),
    Row("nice 19", typed="nice -n 19 {}"),
    Row("one processor", typed="taskset -c 0 {}"),
    Row("no bwrap: the start says what is weaker", before="without bwrap firejail", tells="sandbox"),
    Row("no Xvfb", before="without Xvfb"),
    Row("no slirp4netns", before="without slirp4netns"),
    Row("no /sys", before="umount -l /sys"),
    Row("control groups are not mounted", before="mount -t tmpfs none /sys/fs/cgroup"),
    refused("WEBOTS_HOME leads nowhere", "WEBOTS_HOME of the environment: /nowhere/webots is missing or not executable.* or unset it", typed="WEBOTS_HOME=/nowhere {}"),
    Row("DISPLAY of nobody", typed="DISPLAY=:77 XAUTHORITY=/nowhere WAYLAND_DISPLAY=x {}"),
    refused("a program of ours is not there", "simulation server ended at once: There is no program .*/webots-process-guard", "umount build/release/bin; cp -a $BIN/. build/release/bin; rm build/release/bin/webots-process-guard"),
    refused("a program of ours can't be run", "webots-simulation-server.*(Permission|run|exec|start)|Permission denied",
            "umount build/release/bin; cp -a $BIN/. build/release/bin; chmod -x build/release/bin/webots-simulation-server"),
]

FILES = [
    broken("a configuration in UTF-16", "UTF-16|UTF-8|encod", SESSION, "iconv -t UTF-16", needs=("iconv",)),
    broken("a configuration with a byte order mark", "byte order mark.*: save it as UTF-8 without one", SESSION, "sed '1s/^/\\xef\\xbb\\xbf/'"),
    broken("a configuration with Windows' line ends", "", SESSION, "sed 's/$/\\r/'"),
    broken("the port is 19.99e2", "", SESSION, "sed 's/1999/19.99e2/'"),
    broken("the port is a text", "port", SESSION, "sed 's/1999/\"1999\"/'"),
    broken("a comma is missing", "local.json:\\d+:\\d+: .*", SESSION, "sed 's/false,/false/'"),
    broken("an empty configuration", "local.json.*", SESSION, "true"),
    refused("a configuration that may not be read", "local.json.*(Permission|read)", f"chmod 600 {SESSION}; chown root {SESSION}"),
    refused("a configuration that is a folder", "local.json", f"rm {SESSION}; mkdir {SESSION}"),
    refused("a configuration that is a pipe", "local.json", f"rm {SESSION}; mkfifo -m 666 {SESSION}"),
    refused("a configuration that is a dead link", "local.json|config/session", f"ln -sf /nowhere {SESSION}"),
    Row("the configuration is removed while it runs", before=f"cp {SESSION} /tmp/kept",
        check=f"rm {SESSION}; as_user ./server.sh status | grep -i \"can't be read\\|gone\\|missing\" -q; as_user ./server.sh stop | grep -q '^Stopped session'; "
        f"cp /tmp/kept {SESSION}; as_user ./server.sh start >/dev/null"),
    Row("the configuration becomes a link while it runs", check=f"cp {SESSION} /srv/elsewhere.json; ln -sf /srv/elsewhere.json {SESSION}; "
        "as_user ./server.sh status | grep -q 'session server runs'; as_user ./server.sh start | grep -q ^Open"),
    refused("a name that is none", "config/session/nowhere.json", config="nowhere"),
    # A machine may be announced later.
    Row("simulationServers is empty", warns='^Warning: .*"simulationServers": no machine is listed, .*: name one', before=f"set_key {SESSION} simulationServers '[]'"),
    Row("the same machine twice", before=f"set_key {SESSION} simulationServers '[\"localhost:2000\",\"localhost:2000\"]'",
        tells='Warning: .*"simulationServers", entry 2: .* is the machine of entry 1 again: remove one'),
    Row("viewerUrl is hello", before=f"set_key {SESSION} viewerUrl '\"hello\"'", tells='Warning: .*"viewerUrl"'),
    refused("timeout is \"2h\"", "7200", f"set_key {SIMULATION} timeout '\"2h\"'"),
    refused("simulationMemory is \"4 GB\"", 'local.json:\\d+:\\d+: key "simulationMemory".* write 4096, ', f"set_key {SIMULATION} simulationMemory '\"4 GB\"'"),
    refused("sandbox is firejail, which is not installed", "firejail", f"without firejail; set_key {SIMULATION} sandbox '\"firejail\"'"),
    refused("the simulator is not there", "webotsHome|simulator|webots", f"set_key {SIMULATION} webotsHome '\"/nowhere\"'"),
    Row("the projects are not there", tells='Warning: .*"projectsDir": there is no folder /nowhere', before=f"set_key {SIMULATION} projectsDir '\"/nowhere\"'"),
    Row("an expired certificate", user="root", config="tls", tells="expired|valid", before="dated_certificate 20200101000000Z 20210101000000Z"),
    Row("a certificate that is not valid yet", user="root", config="tls", tells="not valid|not yet|valid from", before="dated_certificate 20990101000000Z 21000101000000Z"),
    refused("a key of 1024 bits", "only 1024 bits.* Get one with a key of 2048 bits", "key='rsa:1024' certificate -days 9", user="root", config="tls"),
    refused("a key of another certificate", "key.*(not|other|fit|match|belong)", "certificate -days 9; openssl genrsa -out tls/key.pem 2048 2>/dev/null", user="root", config="tls"),
    refused("a certificate that is none", "the certificate tls/certificate.pem can't be used", "mkdir tls; echo hello | tee tls/certificate.pem >tls/key.pem", user="root", config="tls"),
    refused("a certificate in DER", "tls/certificate.pem.*PEM", "certificate -days 9; openssl x509 -in tls/certificate.pem -outform DER -out /tmp/der; cp /tmp/der tls/certificate.pem",
            user="root", config="tls"),
    refused("certificate and key are exchanged", "tls/certificate.pem", "certificate -days 9; mv tls/key.pem tls/k; mv tls/certificate.pem tls/key.pem; mv tls/k tls/certificate.pem",
            user="root", config="tls"),
    refused("a key that may not be read", "tls/key.pem.*(Permission|read)", "certificate -days 9; chmod 600 tls/key.pem; sysctl -qw net.ipv4.ip_unprivileged_port_start=80", config="tls"),
    Row("a certificate with Windows' line ends", user="root", config="tls", before="certificate -days 9; sed -i 's/$/\\r/' tls/certificate.pem tls/key.pem"),
    Row("a certificate whose chain is missing", user="root", config="tls", tells="chain|authorit|intermediate|issue",
        before="certificate -days 9; openssl req -x509 -newkey rsa:2048 -nodes -subj /CN=authority -days 9 -keyout /tmp/a.key -out /tmp/a.pem 2>/dev/null; "
        "openssl x509 -req -in /srv/request -CA /tmp/a.pem -CAkey /tmp/a.key -CAcreateserial -copy_extensions copy -days 9 -out tls/certificate.pem 2>/dev/null"),
    refused("a key that has a passphrase", "pass|encrypt", "certificate -days 9; openssl rsa -aes256 -passout pass:x -in tls/key.pem -out /tmp/k 2>/dev/null; cp /tmp/k tls/key.pem",
            user="root", config="tls"),
]

ROWS = PLAIN + SCRIPT + FOLDERS + PEOPLE + NETWORK + LOCALES + LIMITS + FILES
