#!/usr/bin/env bash
# Starts and stops the servers of this folder, building them first if need be: session server, simulation server, and the example of a
# website that starts simulations. Or makes Debian packages of the two servers, and installs them as services of this machine.
[ -n "${BASH_VERSION-}" ] || exec bash "$0" "$@" # sh server.sh
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" # of the script, where this is a link to it
source cmake/packages/install.sh

programs=$PWD/build/release/bin
patience=30 # seconds for a server to answer or to end
calm=15     # seconds for a machine to be free: loads are means of 5 s, and asked for every 5 s

usage()
{
    cat <<'END'
Usage: ./server.sh start|stop|restart|status [NAME|--lan]
       ./server.sh package|install

  start    Install missing packages, build, and start the servers with config/simulation/NAME.json,
           config/session/NAME.json and config/website_host/NAME.json: those whose file exists. NAME is "local"
           unless given.
           Where a configuration names a certificate in this folder that is not there, as "tls" does, one is made
           that is signed by nobody: good for a try, until you have a real one.
           --lan is short for "lan": a site for a class, which every machine of the network reaches; the address for
           the others is printed, with a QR code for phones, and where a teacher opens a class, with the password,
           which is made at the first start.
  stop     Stop them. Simulations that run are ended in order. With NAME only the servers that run with it.
  restart  stop, whatever runs, and start.
  status   Say which servers run, since when, with which configuration, at which address, where they log, how
           many seats are taken, and what visitors meet. With NAME only those that run with it.
  package  Install missing packages, build, and make Debian packages of the servers in build/release/packages, to be
           installed on other machines.
  install  The same, and install them here: as services that systemd starts with the machine, configured in
           /etc/webots-cloud. An edited configuration is kept.

Exit statuses: 0: done, or running; 1: it failed; 2: wrong arguments; 3, of status: no such server runs.
Servers that run already are left as they are. They log to log/session, log/simulation and log/website_host.
END
}

main()
{
    [[ ${2-} != --lan ]] || set -- "$1" lan "${@:3}"
    local verb=${1-} name=${2-local}
    [[ $verb != -h && $verb != --help ]] || { usage && exit 0; }
    [[ $verb =~ ^(start|stop|restart|status)$ && $# -le 2 || $verb =~ ^(package|install)$ && $# -eq 1 ]] || { usage >&2 && exit 2; }
    if [[ $verb == status ]]; then # changes nothing, so it waits for nobody
        status "${2-}"
        return
    fi
    ordinary log folder
    mkdir -p log 2>/dev/null || fail "The folder log can't be made in $PWD: may $(id -un) write there?"
    ordinary log/.server.lock
    [[ -w log && ( ! -e log/.server.lock || -w log/.server.lock ) ]] || tell_owner
    exec {lock}>log/.server.lock
    flock "$lock" # one of us at a time

    if [[ $verb == stop ]]; then
        stop "${2-}"
        return
    fi
    if [[ $verb == package ]]; then
        make_packages
        printf '%s\n' build/release/packages/*.deb
        return
    fi
    if [[ $verb == install ]]; then
        install_site
        return
    fi
    prepare "$name"
    [[ $verb == start ]] || stop ""
    start "$name"
    show_website "$(config website_host "$name")"
}

# The folder log can't be written.
tell_owner()
{
    local owner
    owner=$(stat -c %U log)
    [[ $owner != "$(id -un)" ]] || fail "Nothing can be written to $PWD/log: is the disk read-only?"
    fail "The folder log belongs to $owner, who has started servers here. Run this as $owner; or let them run ./server.sh stop," \
        "and then: sudo chown -R $(id -un): log"
}

# All that can go wrong before a server is started or stopped.
prepare()
{
    local name=$1 kind file
    [[ $name =~ ^[A-Za-z0-9_.-]+$ && ( -e $(config session "$name") || -e $(config simulation "$name") ) ]] ||
        fail "Expected the name of a configuration, found \"$name\":" \
            "there is neither $(config session "$name") nor $(config simulation "$name")."
    install_packages cmake/packages/build.txt
    install_page_libraries
    build site
    for kind in website_host simulation session; do
        file=$(config "$kind" "$name")
        [[ ! -e $file || $kind == website_host ]] || make_certificate "$file"
        [[ ! -e $file || $kind != website_host ]] || install_editor
        [[ ! -e $file || $kind != session ]] || make_teacher_password "$file"
        [[ ! -e $file ]] || check_configuration "$kind" "$file"
    done
}

# check_configuration KIND FILE: ends with what is wrong. What is only odd, or can't be reached from here now, is in the server's log.
check_configuration()
{
    local found
    found=$("$(program "$1")" --check-config "$2" 2>&1) || {
        echo "$found" >&2
        exit 1
    }
}

# make_certificate FILE: for a configuration that names a certificate and a key in this folder, neither of which is there. Those of others,
# in /etc/letsencrypt, say, are made by others.
make_certificate()
{
    local certificate key name folder
    certificate=$(setting "$1" sslCertificate)
    key=$(setting "$1" sslKey)
    [[ -n $certificate && -n $key && $certificate$key != *..* && $certificate != /* && $key != /* ]] || return 0
    [[ ! -e $certificate && ! -L $certificate && ! -e $key && ! -L $key ]] || return 0
    name=$(setting "$1" server)
    name=${name:-localhost}
    [[ $name =~ ^[A-Za-z0-9.-]+(:[0-9]+)?$ ]] || fail "No certificate is made for \"$name\": put one into $certificate, and its key into $key."
    name=${name%%:*}
    mkdir -p "$(dirname "$certificate")" "$(dirname "$key")"
    folder=$(mktemp -d)
    if ! openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 365 -subj "/CN=$name" \
        -addext "subjectAltName=DNS:$name,DNS:localhost,IP:127.0.0.1,IP:::1$(own_names)" \
        -keyout "$folder/key" -out "$folder/certificate" 2>"$folder/log"; then
        cat "$folder/log" >&2
        rm -r "$folder"
        fail "openssl could not make a certificate for $name."
    fi
    install -m 600 "$folder/key" "$key"
    install -m 644 "$folder/certificate" "$certificate"
    rm -r "$folder"
    echo "Made $certificate for $name, valid for a year. Nobody vouches for it, so browsers warn: replace it and $key by real ones."
}

# make_teacher_password FILE: for a session server whose configuration names a file of ours that is not there.
make_teacher_password()
{
    local file letters
    file=$(setting "$1" teacherPasswordFile)
    [[ $file == log/* && $file != *..* ]] || return 0
    ordinary "$file"
    [[ ! -s $file ]] || return 0
    letters=$(head -c 1000 /dev/urandom | LC_ALL=C tr -dc a-hjkmnp-z) # some 90, none of which looks like another
    [[ ${#letters} -ge 12 ]] || fail "No password for teachers could be made: /dev/urandom gave no letters."
    (umask 077 && echo "${letters:0:4}-${letters:4:4}-${letters:8:4}" >"$file.new") 2>/dev/null && mv -f "$file.new" "$file" || {
        rm -f "$file.new"
        fail "The password for teachers can't be written to $file: is the disk full?"
    }
}

make_packages()
{
    install_packages cmake/packages/build.txt cmake/packages/package.txt
    install_page_libraries
    build installable
    rm -rf build/release/packages # of an older version
    cpack --preset release >build/release/packages.log 2>&1 || {
        tail -n 10 build/release/packages.log >&2
        fail "The packages can't be made: see build/release/packages.log"
    }
}

# Packages, and services of them.
install_site()
{
    local kind
    [[ $(id -u) -eq 0 ]] || command -v sudo >/dev/null || fail "Installing needs root, and there is no sudo: run ./server.sh install as root."
    for kind in session simulation; do
        [[ -z $(running_pid "$kind") ]] || fail "The $(called "$kind") of this folder runs, and has the ports: ./server.sh stop"
    done
    make_packages
    as_root apt-get install -y -q --reinstall -o Dpkg::Options::=--force-confdef -o Dpkg::Options::=--force-confold \
        "$PWD"/build/release/packages/webots-cloud-*.deb || fail "apt-get install failed."
    cat <<'END'

Installed. Open http://localhost:1999/viewer/ unless you have configured another address.
  Configurations: /etc/webots-cloud/session.json and simulation.json. The site is for this machine alone until you change
  "listenAddress" there; docs/site.md has the steps for a class, and for a public site.
  Services:       systemctl status webots-session-server webots-simulation-server
  Logs:           /var/lib/webots-cloud/session/log and /var/lib/webots-cloud/simulation/log
  To remove all:  sudo apt purge webots-cloud-session-server webots-cloud-simulation-server webots-cloud-demo
END
    [[ -d /run/systemd/system ]] || echo "This machine runs no systemd now: the services start when it does."
}

# What other machines may call this one: the certificate of a simulation server is for the session server's eyes.
own_names()
{
    local each
    each=$(hostname 2>/dev/null) && [[ $each =~ ^[A-Za-z0-9.-]+$ ]] && printf ',DNS:%s' "$each"
    for each in $(hostname -I 2>/dev/null); do
        printf ',IP:%s' "$each"
    done
}

# The libraries that show 3D scenes and QR codes. Where they can't be had, the first build is made without, and later starts do not wait
# for them again.
install_page_libraries()
{
    [[ ! -e build/release/build.ninja ]] || command -v npm >/dev/null || return 0
    install_node_packages src/web/view || echo "The viewer will show pictures only: npm could not install the library for 3D." >&2
    install_node_packages src/web/class || echo "Classes will have no QR code: npm could not install its library." >&2
}

# build TARGET: what of it is not built yet, showing how far it is in one line. What the tools say is in build/release/build.log.
build()
{
    local log=build/release/build.log
    mkdir -p build/release
    ordinary "$log"
    : >"$log"
    # Configured anew also when a library of the pages has come since.
    [[ -e build/release/build.ninja && ! build/node/src/web/view -nt build/release/build.ninja &&
        ! build/node/src/web/class -nt build/release/build.ninja ]] || cmake --preset release >"$log" 2>&1 || build_failed "$log"
    NINJA_STATUS='[%f/%t] ' cmake --build --preset release --parallel "$(compilers)" --target "$1" 2>&1 | show_progress "$log" || build_failed "$log"
}

# How many compilers may run at once: each takes up to 1 GB of memory.
compilers()
{
    local room processors
    processors=$(nproc)
    room=$(awk '/^MemAvailable:/ { print int($2 / 1000000) }' /proc/meminfo)
    echo $((room < 1 ? 1 : room < processors ? room : processors))
}

# show_progress LOG: keeps what Ninja says in the log, and counts its steps: in one line of a terminal, in four lines of anything else.
show_progress()
{
    local line step steps quarter told=0
    while IFS= read -r line; do
        printf '%s\n' "$line" >>"$1"
        [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\  && ${BASH_REMATCH[1]} -gt 0 ]] || continue
        step=${BASH_REMATCH[1]} steps=${BASH_REMATCH[2]}
        if [[ -t 1 ]]; then
            printf '\rBuilding: step %s of %s\033[K' "$step" "$steps"
            [[ $step -lt $steps ]] || printf '\n'
        else
            quarter=$((4 * step / steps))
            [[ $quarter -eq $told ]] || echo "Building: step $step of $steps"
            told=$quarter
        fi
    done
}

# build_failed LOG: ends with what the tools complain of, without their command lines.
build_failed()
{
    local lines=40
    [[ ! -t 1 ]] || echo
    if grep -q '^FAILED: ' "$1"; then
        sed -n '/^FAILED: /,$p' "$1" | sed -e '/^FAILED: /{n;d}' -e '/^\[[0-9]/d' | head -n "$lines" >&2
    else
        tail -n "$lines" "$1" >&2
    fi
    ! grep -q 'Killed signal terminated' "$1" || echo "A compiler was killed, for the machine has too little memory: close other programs, or add swap space." >&2
    fail "The build failed. All that it said is in $1."
}

start()
{
    local name=$1 kind started=
    for kind in website_host simulation session; do
        [[ ! -e $(config "$kind" "$name") ]] || start_server "$kind" "$name"
    done
    [[ -z $started || ! -e $(config session "$name") || ! -e $(config simulation "$name") ]] || await_machine "$name"
    [[ -e $(config session "$name") ]] || return 0
    echo "Open $(address "$(config session "$name")")viewer/"
    [[ $(setting "$(config session "$name")" server) != '*' ]] || show_network_addresses "$(config session "$name")"
    show_class "$(config session "$name")"
}

# show_class FILE: where teachers open a class, if they can. The page makes the link for students from its own address: one that they reach.
show_class()
{
    local host file
    file=$(setting "$1" teacherPasswordFile)
    [[ -n $file || -n $(setting "$1" teacherPassword) ]] || return 0
    host=$(network_addresses | tail -n 1)
    echo "For a class: $(address "$1" "${host:-localhost}")class/"
    [[ $file != log/* ]] || echo "Password of teachers: $(head -n 1 "$file") (in $file)"
}

# show_network_addresses FILE: of a site without a name, where the other machines of our networks find it.
show_network_addresses()
{
    local own found=
    for own in $(network_addresses); do
        found=$(address "$1" "$own")viewer/
        echo "From other machines of the network: $found"
    done
    [[ -n $found ]] || { echo "This machine is in no network: others can't reach it." && return; }
    [[ ! -t 1 ]] || ! command -v qrencode >/dev/null || qrencode -t ANSIUTF8 "$found"
    echo "If they can't reach it, a firewall keeps them out: port $(setting "$1" port) has to be open."
}

# Ours in the networks that we share with other machines, not in those of containers and virtual machines.
network_addresses()
{
    ip -4 -o address show up scope global | awk '$2 !~ /^(docker|br-|veth|virbr|lxc|podman|cni)/ { sub("/.*", "", $4); print $4 }'
}

stop()
{
    local name=$1 kind pid stopped=
    for kind in session simulation website_host; do
        pid=$(running_pid "$kind")
        [[ -n $pid ]] || continue
        [[ -z $name || $(running_name "$pid") == "$name" ]] || continue
        stop_server "$kind" "$pid"
        stopped=yes
    done
    [[ -n $stopped ]] || echo "No ${name:+$name }server is running"
}

# As systemctl does: 3 where nothing runs.
status()
{
    local name=$1 kind pid running=
    for kind in simulation session website_host; do
        pid=$(known_pid "$kind")
        [[ -n $pid ]] || continue
        [[ -z $name || $(running_name "$pid") == "$name" ]] || continue
        running=yes
        show_status "$kind" "$pid"
    done
    [[ -n $running ]] || { echo "No ${name:+$name }server is running" && return 3; }
}

# show_status KIND PID
show_status()
{
    local kind=$1 pid=$2 file port load
    file=$(config "$kind" "$(running_name "$pid")")
    port=$(setting "$file" port)
    port=${port:-2000}
    load=$(ask "$port" "$(setting "$file" sslCertificate)" /load) || true # openssl misses a goodbye after the answer
    echo "The $(called "$kind") runs since $(began "$pid") ($pid)"
    echo "  configuration  $file"
    case $kind in
        website_host) echo "  address        http://localhost:$port/" ;;
        simulation) echo "  address        $(address "$file")monitor" ;; # it has no other page
        *) echo "  address        $(address "$file")" ;;
    esac
    echo "  logs           $(log_folder "$file")/$kind"
    [[ $load == HTTP/1.1\ [24]* ]] || echo "  It does not answer on port $port."
    [[ $kind != simulation || $load != *'"capacity":'* ]] || echo "  seats          $(figure "$load" sessions) of $(figure "$load" capacity) taken"
    [[ $kind != session ]] || show_site "$(ask "$port" "$(setting "$file" sslCertificate)" /monitor)" || true
}

# show_site MONITOR: what visitors meet there, and why machines refused them. Nothing if the monitor has a password.
show_site()
{
    local word='"\(\([^"\\]\|\\.\)*\)"'
    sed -n 's/.*"stateText":'"$word"'.*/  visitors       \1/p' <<<"$1"
    sed 's/{"address":/\n&/g' <<<"$1" | sed -n 's/^{"address":'"$word"'.*"refusal":'"$word"'.*/  \1 refused its last start: \3/p' | sed 's/\\\(["\\]\)/\1/g'
}

# figure JSON NAME: a number in it.
figure() { sed -n 's/.*"'"$2"'":\([0-9]*\).*/\1/p' <<<"$1" | head -n 1; }

# When a process began.
began()
{
    local fields boot
    fields=$(cat "/proc/$1/stat" 2>/dev/null) && read -ra fields <<<"${fields##*) }" # what follows the name: its 20th is when, after booting
    boot=$(sed -n 's/^btime //p' /proc/stat)
    date -d "@$((boot + ${fields[19]:-0} / $(getconf CLK_TCK)))" '+%Y-%m-%d %H:%M:%S'
}

# The folder of a configuration's logs, without their kind.
log_folder()
{
    local folder
    folder=$(setting "$1" logDir)
    echo "${folder:-log}"
}

start_server()
{
    local kind=$1 name=$2 pid file port
    file=$(config "$kind" "$name")
    pid=$(running_pid "$kind")
    if [[ -n $pid ]]; then
        [[ $(running_name "$pid") == "$name" ]] ||
            fail "The $(called "$kind") ($pid) runs with $(config "$kind" "$(running_name "$pid")"): stop it first, or use restart."
        echo "The $name $(called "$kind") is already running ($pid)"
        return
    fi
    port=$(setting "$file" port)
    ! accepts "${port:=2000}" || fail "Port $port is in use by another program: $name $(called "$kind") not started. Change \"port\" in $file."

    ordinary "log/$kind" folder
    mkdir -p "log/$kind"
    ordinary "log/$kind/console.log"
    ordinary "log/.$kind.pid"
    setsid "$(program "$kind")" "$file" </dev/null >"log/$kind/console.log" 2>&1 {lock}>&- &
    pid=$!
    echo "$pid" >"log/.$kind.pid"
    await_answer "$kind" "$pid" "$port" "$(setting "$file" sslCertificate)"
    started=yes
    echo "Started $name $(called "$kind") ($pid)"
}

await_answer()
{
    local kind=$1 pid=$2 port=$3 tls=$4 path=/load deadline=$((SECONDS + patience))
    [[ $kind != website_host ]] || path=/
    until answers "$port" "$path" || { [[ -n $tls ]] && answers "$port" /load 400; }; do
        if ! is_alive "$pid"; then
            rm -f "log/.$kind.pid"
            give_up "$kind" "The $(called "$kind") ended at once."
        fi
        [[ $SECONDS -lt $deadline ]] || give_up "$kind" "The $(called "$kind") ($pid) does not answer on port $port."
        sleep 0.1
    done
}

# Whoever is told the address can start a simulation: the session server has heard of a machine that is free. One that has just
# built all this may be busy for a moment.
await_machine()
{
    local name=$1 file port said= begin=$SECONDS
    file=$(config session "$name")
    port=$(setting "$file" port)
    # Machines that are asked by https answer only who trusts their certificates.
    [[ -z $(setting "$file" sslCertificate) || -n $(setting "$file" internal) ]] || return 0
    until has_room "$port" "$(setting "$file" sslCertificate)"; do
        if [[ $SECONDS -ge $((begin + calm)) ]]; then
            echo "No simulation server is free yet: $(address "$file")monitor shows their loads. The page says when one is."
            return
        fi
        [[ -n $said || $SECONDS -lt $((begin + 2)) ]] || { said=yes && echo "Waiting until a simulation server is free"; }
        sleep 0.1
    done
}

# give_up KIND SENTENCE: shows why, as far as the logs know.
give_up()
{
    local log
    echo "$2 It said:" >&2
    for log in "log/$1/output.log" "log/$1/console.log"; do
        [[ ! -f $log || ! -s $log ]] || { echo "--- $log" && tail -n 10 "$log"; } >&2
    done
    exit 1
}

stop_server()
{
    local kind=$1 pid=$2 deadline=$((SECONDS + patience))
    kill -TERM "$pid" 2>/dev/null || ! is_alive "$pid" || fail "The $(called "$kind") ($pid) belongs to another user."
    while is_alive "$pid"; do
        [[ $SECONDS -lt $deadline ]] || fail "The $(called "$kind") ($pid) has not ended within $patience seconds."
        sleep 0.1
    done
    rm -f "log/.$kind.pid"
    echo "Stopped $(called "$kind") ($pid)"
}

# ordinary PATH [folder]: what is there is a file (a folder, or a link to one), or nothing. Simulations run as we do: a pipe of theirs in the
# place of a file would make us wait for ever, and a link make us overwrite what it leads to.
ordinary()
{
    local path=$1 aside
    [[ -e $path || -L $path ]] || return 0
    if [[ ${2-} == folder ]]; then
        [[ ! -d $path ]] || return 0
    else
        [[ ! -f $path || -L $path || $(stat -c %h "$path") != 1 ]] || return 0
    fi
    aside=$path.set-aside-$$
    mv -T -- "$path" "$aside" || fail "$path is not what it has to be, and can't be moved away. Remove it."
    echo "$path was not what it has to be, and is now $aside" >&2
}

# The same, and a PID file that names none is removed.
running_pid()
{
    local kind=$1 pid
    ordinary "log/.$kind.pid"
    pid=$(known_pid "$kind")
    [[ -n $pid ]] && echo "$pid" || rm -f "log/.$kind.pid"
}

# The process that the PID file of a kind names, if it is still that server: numbers are used again after a crash or reboot.
known_pid()
{
    local kind=$1 pid
    [[ -f log/.$kind.pid ]] && pid=$(cat "log/.$kind.pid" 2>/dev/null) || return 0
    [[ $pid =~ ^[1-9][0-9]*$ && $(argument "$pid" 1) == "$(program "$kind")" ]] && is_alive "$pid" && echo "$pid" || true
}

# The name of the configuration that a server was started with.
running_name()
{
    basename "$(argument "$1" 2)" .json
}

# called KIND: what people call it.
called() { [[ $1 == website_host ]] && echo "website host" || echo "$1 server"; }

# argument PID N: the N-th word of a process's command line; the first is the program.
argument()
{
    tr '\0' '\n' <"/proc/$1/cmdline" | sed -n "$2p"
} 2>/dev/null

# A process that has ended counts as such even where nobody waits for it, as in a container without an init.
is_alive()
{
    local status
    status=$(cat "/proc/$1/stat" 2>/dev/null) && [[ ${status##*) } != [ZX]* ]]
}

# program KIND
program()
{
    [[ $1 == website_host ]] && echo "$programs/webots-website-host" || echo "$programs/webots-$1-server"
}

config() { echo "config/$1/$2.json"; }

# setting FILE KEY: a string, number or boolean of a configuration (that passed the servers' own check).
setting()
{
    tr '\n\t' '  ' <"$1" | sed -n 's/.*"'"$2"'" *: *"\{0,1\}\([^",} ]*\).*/\1/p'
}

# address FILE [HOST]: where browsers find the server of a configuration, with a slash at the end. The host counts for one that has no name.
address()
{
    local server ssl scheme=https separator=/
    server=$(setting "$1" server)
    ssl=$(setting "$1" ssl)
    [[ $ssl != false ]] || scheme=http
    [[ $(setting "$1" portRewrite) != false ]] || separator=:
    [[ $server != '*' ]] || { server=${2-localhost} && separator=:; }
    echo "$scheme://${server:-localhost}$separator$(setting "$1" port)/" | sed 's|^\(https://.*\):443/$|\1/|'
}

# The editor in the page of the website. Nothing is lost but comfort where there is no npm, or it gets no answer.
install_editor()
{
    command -v npm >/dev/null || return 0
    npm_config_fetch_retries=0 npm_config_fetch_timeout=10000 install_node_packages examples/website_host ||
        echo "The page of the website has a plain text field instead of an editor: npm could not install one." >&2
}

# show_website FILE: where the example of a website is found, if there is one.
show_website()
{
    [[ ! -e $1 ]] || echo "A website with an editor: http://localhost:$(setting "$1" port)/"
}

# Does anyone listen on the port?
accepts()
{
    (exec 3<>"/dev/tcp/127.0.0.1/$1") 2>/dev/null
}

# answers PORT [PATH [STATUS]]: does a server answer with 200 when it is asked for /load? One that speaks TLS answers us with 400.
answers()
{
    local status
    status=$(
        {
            exec 3<>"/dev/tcp/127.0.0.1/$1" || exit
            printf 'GET %s HTTP/1.1\r\nHost: localhost:%s\r\nConnection: close\r\n\r\n' "${2-/load}" "$1" >&3
            read -r -t 5 line <&3 && echo "$line"
        } 2>/dev/null
    ) && [[ $status == "HTTP/1.1 ${3-200}"* ]]
}

# has_room PORT CERTIFICATE: could a session be placed? The certificate is empty where the server speaks no TLS.
has_room()
{
    [[ $(ask "$1" "$2" /) == "HTTP/1.1 200"*1 ]]
}

# ask PORT CERTIFICATE PATH: the whole answer of a server.
ask()
{
    local request
    printf -v request 'GET %s HTTP/1.1\r\nHost: localhost:%s\r\nAccept: application/json\r\nConnection: close\r\n\r\n' "$3" "$1"
    if [[ -n $2 ]]; then
        printf '%s' "$request" | timeout 5 openssl s_client -connect "127.0.0.1:$1" -quiet -ign_eof
    else
        exec 3<>"/dev/tcp/127.0.0.1/$1" && printf '%s' "$request" >&3 && timeout 5 cat <&3
    fi
} 2>/dev/null

main "$@"
