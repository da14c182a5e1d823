"""The rows of tests/real_projects.py: cases that people have met or published, each with its source, `owner/repository#number`, or a file of a
repository. Inputs are made anew, with other names; nothing is copied. One class for each kind of row; `says` is what people have to read,
a regular expression, and empty where everything works; docs/migration.md has the reason where that is a refusal. `gap`: why a row does not end as
it should.
"""

import dataclasses

from .projects import demo_project

ROBOTS = demo_project()
ARENA = ROBOTS["worlds/arena.wbt"].decode()
del ROBOTS["webots.yml"]


@dataclasses.dataclass(kw_only=True)
class Row:
    name: str
    source: str
    says: str = ""
    gap: str = ""


@dataclasses.dataclass(kw_only=True)
class Link(Row):
    """What a page sends to a simulation server, of a repository with the demo project; `{}` is the forge, a real git server."""
    link: str
    repository: str = "owner/robots"
    files: dict = dataclasses.field(default_factory=dict)  # besides the demo project's
    branch: str = "main"


@dataclasses.dataclass(kw_only=True)
class Typed(Row):
    """What people paste into the viewer's field, in a real browser; `{}` is the world, `{quoted}` the same as a value in an address."""
    text: str


@dataclasses.dataclass(kw_only=True)
class Pasted(Row):
    """What people paste into the viewer's field that is no world, in a real browser; `{}` is a repository with the demo project. It shows
    worlds with these titles, of which a press starts the first."""
    text: str
    titles: tuple = ()


@dataclasses.dataclass(kw_only=True)
class Tree(Row):
    """Entries of a repository beside `worlds`: (mode, name, content), also such as git itself would not make. `kept`: those that a simulation
    finds; the console of the view names the others."""
    entries: list
    kept: tuple = ()


@dataclasses.dataclass(kw_only=True)
class Container(Row):
    """A `webots.yml` of a project that a real Docker engine runs; `told`: messages that browsers get before the simulator's address."""
    yml: str
    told: tuple = ()
    files: dict = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(kw_only=True)
class Proxy(Row):
    """Rules of a real `server` in front of a site with `relay`; `{}` is the session server's port. `path` is where the site is,
    `scheme` what browsers are told. `says` is what `asks` answers, if it is not what browsers need."""
    server: str
    rules: str
    path: str = ""
    scheme: str = "wss"
    asks: str = "/client"


@dataclasses.dataclass(kw_only=True)
class Check(Row):
    """`option httpchk`, or more, of a real HAProxy: the servers count as up."""
    check: str
    of: tuple = ("session", "simulation")


@dataclasses.dataclass(kw_only=True)
class Configuration(Row):
    """A configuration of the Python servers; --check-config accepts it and says so, or refuses it (`refused`)."""
    kind: str
    keys: dict
    refused: bool = False


@dataclasses.dataclass(kw_only=True)
class Elsewhere(Row):
    """A case that a test of the suite has already: its file, and words of it."""
    file: str
    words: str


def world(header="#VRML_SIM R2025a utf8", ends="\n", begins=""):
    return begins + header + ends + ARENA.partition("\n")[2].replace("\n", ends)


ENGINE = "cyberbotics/webots-server"

LINKS = [
    Link(name="a repository whose name begins with .git", source="Jean-Eudes-le-retour/.git-obstacle_avoidance webots.yml",
         repository="ada-l/.git-walls", link="{}/ada-l/.git-walls/blob/main/worlds/arena.wbt"),
    Link(name="an owner that begins with a hyphen", source="the issue", repository="-ada-/robots", link="{}/-ada-/robots/blob/main/worlds/arena.wbt"),
    Link(name="a repository that is a hyphen", source="the issue", repository="ada/-", link="{}/ada/-/blob/main/worlds/arena.wbt"),
    Link(name="dots and underscores in the name of a repository", source="TotallyRandomGus/my_own-inverted.pendulum_benchmark webots.yml",
         repository="ada/my_own-line.walker_", link="{}/ada/my_own-line.walker_/blob/main/worlds/arena.wbt"),
    Link(name="a world with a plus in its name", source="Paul901003/webots_program worlds/ur5e+gripper.wbt", files={"worlds/arm+hand.wbt": ARENA},
         link="{}/owner/robots/blob/main/worlds/arm+hand.wbt"),
    Link(name="a plus that a page has encoded", source="Paul901003/webots_program worlds/ur5e+gripper.wbt", files={"worlds/arm+hand.wbt": ARENA},
         link="{}/owner/robots/blob/main/worlds/arm%2Bhand.wbt"),
    Link(name="a world in the root", source="WeeFav/Webots map4.wbt", files={"map.wbt": ARENA}, link="{}/owner/robots/blob/main/map.wbt",
         says='worlds have to be in a folder "worlds", as in worlds/map.wbt'),
    Link(name="a world in a folder Windows_Scripts", source="WeeFav/Webots Windows_Scripts/map4.wbt", files={"Windows_Scripts/map.wbt": ARENA},
         link="{}/owner/robots/blob/main/Windows_Scripts/map.wbt", says='worlds have to be in a folder "worlds", as in worlds/map.wbt'),
    Link(name="a world in a folder world", source="the issue", files={"world/map.wbt": ARENA}, link="{}/owner/robots/blob/main/world/map.wbt",
         says='worlds have to be in a folder "worlds", as in worlds/map.wbt'),
    Link(name="a world in a folder below worlds", source="WeeFav/Webots src/webots_launch/worlds/autonomous_drive/city.wbt",
         files={"src/start/worlds/drive/city.wbt": ARENA}, link="{}/owner/robots/blob/main/src/start/worlds/drive/city.wbt",
         says='worlds have to be in a folder "worlds", as in worlds/city.wbt'),
    Link(name="a project deep in a workspace of ROS", source="WeeFav/Webots ros2_ws/src/my_package/worlds/my_world.wbt",
         files={"ros2_ws/src/my_package/worlds/my_world.wbt": ARENA, "ros2_ws/src/my_package/package.xml": "<package/>"},
         link="{}/owner/robots/blob/main/ros2_ws/src/my_package/worlds/my_world.wbt"),
    Link(name="a PROTO of the library", source="cyberbotics/webots docs/guide/webots-cloud.md", files={"protos/Car.proto": "#VRML_SIM R2025a utf8\n"},
         link="{}/owner/robots/blob/main/protos/Car.proto", says="Missing worlds folder"),
    Link(name="the page of a repository", source="cyberbotics/webots-cloud README.md", link="{}/owner/robots", says="it leads to a folder"),
    Link(name="the page of a folder worlds", source="cyberbotics/webots docs/guide/webots-cloud.md", link="{}/owner/robots/tree/main/worlds", says="it leads to a folder"),
    Link(name="git's own address of a repository", source="roboyoshi/datacurator-filetree#50", link="{}/owner/robots.git", says="it leads to a folder"),
    Link(name="a branch with a slash", source="IonicaBizau/git-url-parse#137", branch="feature/new-arm",
         link="{}/owner/robots/blob/feature/new-arm/worlds/arena.wbt"),
    Link(name="a branch called -f", source="the issue", branch="-f", link="{}/owner/robots/blob/-f/worlds/arena.wbt"),
    Link(name="raw with refs/heads, as GitHub has it since 2024", source="bitmovin/bitmovin-api-sdk-examples#66",
         link="{}/owner/robots/raw/refs/heads/main/worlds/arena.wbt"),
    Link(name="a link to some lines", source="cyberbotics/webots#4195", link="{}/owner/robots/blob/main/worlds/arena.wbt#L3-L9"),
    Link(name="a branch called master of a repository that has main", source="cfillion/reapack-index#7",
         link="{}/owner/robots/raw/master/worlds/arena.wbt", says='no branch or tag .*master'),
    Link(name="a letter in the wrong case", source="Autodesk/synthesis#349", files={"worlds/Maze.wbt": ARENA},
         link="{}/owner/robots/blob/main/worlds/maze.wbt", says="maze\\.wbt does not exist"),
    Link(name="an address with a user's name", source="cyberbotics/webots#3977", link="http://ada@{host}/owner/robots/blob/main/worlds/arena.wbt",
         says="The URL must start with"),
    Link(name="the address of SSH", source="asyncapi/jasyncapi-idea-plugin#102", link="git@{host}:owner/robots.git", says="The URL must start with"),
    Link(name="an address of Webots of 2020", source="cyberbotics/webots#2249", link="webots://{host}/owner/robots/branch/main/worlds/arena.wbt",
         says="The URL must start with"),
    Link(name="names of streets in Chinese, and paths of Windows", source="WeeFav/Webots Windows_Scripts/map4.wbt",
         files={"worlds/city.wbt": ARENA + 'Solid {\n  name "\u548c\u5e73\u8def"\n  children [ Shape { appearance Appearance { texture ImageTexture { '
                'url [ "D:/Webots/textures/line.png" ] } } } ]\n}\n'}, link="{}/owner/robots/blob/main/worlds/city.wbt"),
    Link(name="backslashes in the path of a PROTO", source="cyberbotics/webots_ros2#573",
         files={"worlds/extern.wbt": world("#VRML_SIM R2025a utf8\n\nEXTERNPROTO \"..\\\\protos\\\\Car.proto\"\n"), "protos/Car.proto": "#VRML_SIM R2025a utf8\n"},
         link="{}/owner/robots/blob/main/worlds/extern.wbt"),
    Link(name="a world that Windows has written", source="nobody's, tried here", files={"worlds/dos.wbt": world(ends="\r\n")},
         link="{}/owner/robots/blob/main/worlds/dos.wbt"),
    Link(name="a world of another year", source="cyberbotics/webots#3430", files={"worlds/old.wbt": world("#VRML_SIM R2020b utf8")},
         link="{}/owner/robots/blob/main/worlds/old.wbt"),
]

POINTER = f"version https://git-lfs.github.com/spec/v1\noid sha256:{64 * 'a'}\nsize 67084\n"
LINKS += [
    Link(name="a mesh that is a pointer, of a forge that does not give it", source="osrf/gazebo_models#90, AgibotTech/genie_sim#176",
         files={"protos/meshes/hand.stl": POINTER}, link="{}/owner/robots/blob/main/worlds/arena.wbt", says=r"The large files \(Git LFS\) of .* has no LFS server"),
    Link(name="a submodule", source="cyberbotics/webots_ros2#859", link="{}/owner/robots/blob/main/worlds/arena.wbt",
         files={"importer/urdf": ("160000", 40 * "a"), ".gitmodules": '[submodule "importer/urdf"]\n\tpath = importer/urdf\n\turl = ../urdf\n'}),
]

OTHERS_YML = {
    "a YAML of one's own words": ("montanocjose1/sistema-solar-webots webots.yml", "description: The planets\nfile: worlds/arena.wbt\ntype: demo\n"),
    "lists in the YAML": ("farahtourait-ai/webots_speed_control_project webots.yaml", 'version: "2025a"\nworlds:\n  - worlds/arena.wbt\ncontrollers:\n  drive: controllers/drive.py\n'),
    "an empty first line": ("hasnae-drib/emotion-webots-sim webots.yml", "\nversion: 1.0\nworld: worlds/arena.wbt\n"),
    "an unpublished project": ("kDeod/4wdsim webots.yaml", "publish: false\ntype: demo\n"),
    "one line in the YAML": ("smart-home-league/simulation webots.yaml", "publish: true\n"),
}
LINKS += [Link(name=f"{name}", source=source, files={"webots.yml": yml}, link="{}/owner/robots/blob/main/worlds/arena.wbt")
          for name, (source, yml) in OTHERS_YML.items()]
LINKS.append(Link(name="both webots.yml and webots.yaml", source="Gokulnathnallaiya/klarix-humanoid-bot webots.yaml",
                  files={"webots.yml": "type: demo\n", "webots.yaml": "publish: true\n"}, link="{}/owner/robots/blob/main/worlds/arena.wbt"))

TYPED = [
    Typed(name="a leaderboard's link in a list of references", source="cyberbotics/wrestling README.md",
          text='[1]: https://webots.cloud/run?version=R2025a&url={quoted}&type=competition "Leaderboard"'),
    Typed(name="a link to try a competition, of a test site", source="cyberbotics/webots-server#26",
          text="https://benchmark.webots.cloud/run?version=R2025a&url={quoted}&type=competition&context=try"),
    Typed(name="a link of another site, to its page of a simulation", source="cyberbotics/webots#1420", text="https://sim.example.org/simulation?url={}",
          says="is not a world: please copy a link that ends with .wbt"),
    Typed(name="a link between blanks and line ends", source="ganeshsjsu/webots-testing-lab README.md", text="  \n https://webots.cloud/run?url={} \n"),
    Typed(name="a short link of webots.cloud, whose world nobody else knows", source="cyberbotics/webots docs/guide/webots-cloud.md",
          text="https://webots.cloud/ScExample", says="is not a world: please copy a link that ends with .wbt"),
]

ALL = ("Robots in an arena", "Corridor", "Two robots")
PASTED = [
    Pasted(name="the page of a repository", source="cyberbotics/webots-cloud README.md", text="{}", titles=ALL),
    Pasted(name="git's own address of a repository", source="roboyoshi/datacurator-filetree#50", text="{}.git", titles=ALL),
    Pasted(name="the page of a folder worlds, of GitHub", source="cyberbotics/webots docs/guide/webots-cloud.md", text="{}/tree/main/worlds", titles=ALL),
    Pasted(name="the page of a folder, of GitLab", source="the issue", text="{}/-/tree/main/?ref_type=heads", titles=ALL),
    Pasted(name="the page of a branch, of Forgejo", source="the issue", text="{}/src/branch/main", titles=ALL),
    Pasted(name="the page of a folder, of Bitbucket", source="the issue", text="{}/src/main/worlds/", titles=ALL),
    Pasted(name="a link in Markdown", source="cyberbotics/competition-template README.md", text="see [the robots]({}/tree/main)", titles=ALL),
    Pasted(name="a README beside the folder of worlds", source="cyberbotics/wrestling README.md", text="{}/blob/main/README.md", titles=ALL),
    Pasted(name="a folder without worlds", source="WeeFav/Webots Windows_Scripts/map4.wbt", text="{}/tree/main/controllers", says="There are no worlds in .*/controllers"),
    Pasted(name="a repository that is not there", source="IonicaBizau/git-url-parse#137", text="{}-of-nobody", says="does not exist, or is private"),
    Pasted(name="a repository of another forge", source="cyberbotics/webots#3977", text="https://forge.example.org/ada/robots", says="The address must start with"),
]

LATIN = b"Stra\xdfe.png"
TREES = [
    Tree(name="the icon of a folder of macOS", source="tisfeng/Easydict#1070", entries=[("100644", b"Icon\r", "x")], kept=(b"Icon\r",)),
    Tree(name="such an icon in a folder", source="freysie/compulsion#1", entries=[("40000", b"protos", [("100644", b"Icon\r", "x")])], kept=(b"protos/Icon\r",)),
    Tree(name="a name in Latin-1", source="fshost/node-dir#60", entries=[("100644", LATIN, "x")], kept=(LATIN,)),
    Tree(name="colons, asterisks and question marks", source="leachim6/hello-world#1367",
         entries=[("100644", b"a:b*c?.txt", "x"), ("100644", b'"cup" <1>|2.md', "x")], kept=(b"a:b*c?.txt", b'"cup" <1>|2.md')),
    Tree(name="a device of Windows", source="actions/checkout#616", entries=[("100644", b"aux.cpp", "x"), ("100644", b"NUL", "x")],
         kept=(b"aux.cpp", b"NUL")),
    Tree(name="a blank or a dot at the end", source="onekey-sec/unblob#1342", entries=[("100644", b"long ", "x"), ("100644", b"whatever......", "x")],
         kept=(b"long ", b"whatever......")),
    Tree(name="an apostrophe and brackets", source="roboyoshi/datacurator-filetree#50", entries=[("100644", b"[Ada 01] - Ada's Robot.m4b", "x")],
         kept=(b"[Ada 01] - Ada's Robot.m4b",)),
    Tree(name="a backslash", source="git-for-windows/git#2777", entries=[("40000", b"lib\\__pycache__", [("100644", b"a.pyc", "x")])],
         says=r"lib\\.*left out: its name could do harm"),
    Tree(name="a repository in the repository", source="jelmer/dulwich#1226", entries=[("40000", b".git", [("100644", b"config", "x")])],
         says=r'"\.git".*left out: its name could do harm'),
    Tree(name="a spelling of .git", source="go-git/go-git#2081", entries=[("40000", b"git~1", [("100644", b"config", "x")])],
         says=r'"git~1".*left out: its name could do harm'),
    Tree(name="a folder .GIT below another", source="entireio/cli#1863",
         entries=[("40000", b"data", [("100644", b"a", "x"), ("40000", b".GIT", [("100644", b"a", "x")])])],
         kept=(b"data/a",), says=r'"data/\.GIT".*left out: its name could do harm'),
    Tree(name="names that begin with .git", source="jelmer/dulwich#2098", entries=[("100644", b".gitkeep", "x"), ("100644", b".gitattributes", "x"),
                                                                                  ("40000", b".github", [("100644", b"a.yml", "x")])],
         kept=(b".gitkeep", b".gitattributes", b".github/a.yml")),
    Tree(name="modes that git's own tools complain of", source="jelmer/dulwich#1226 (badFilemode)", entries=[("100664", b"a.py", "x")], kept=(b"a.py",)),
    Tree(name="a link to somebody's home", source="remotestorage/remotestorage.js#70", entries=[("120000", b"drive", "/home/ada/src/drive")]),
    Tree(name="links that lead to nothing, or to another file", source="QMCPACK/qmcpack#5470",
         entries=[("100644", b"a.stl", "x"), ("120000", b"b.stl", "a.stl"), ("120000", b"c.stl", "gone.stl")], kept=(b"a.stl", b"b.stl", b"c.stl")),
    Tree(name="names that differ in case", source="mceSystems/node-jsc#9", entries=[("100644", b"Readme", "x"), ("100644", b"readme", "x")],
         kept=(b"Readme", b"readme")),
]

DOCKER = [
    Container(name="an editor, with no blank after the colon", source="Andres-Developer-23/Brazo-Robotico webots.yml",
              yml="publish: true\ntype: demo\ndockerCompose:theia:webots-project/controllers/drive/\n", told=("type:demo\n", "ide: enable")),
    Container(name="an editor, with a blank", source="KnightHP/MARS webots.yml", yml="publish: true\ntype: demo\ndockerCompose: theia:webots-project/controllers/\n",
              told=("type:demo\n",)),
    Container(name="an editor for another folder than the project's", source="Drakxard/Ajedrez webots.yml",
              yml="type: benchmark\ndockerCompose:theia:robot/controllers/drive\n", told=("type:benchmark\n", "ide: enable")),
    Container(name="no line for containers", source="lmhoang06/unk webots.yml", yml="publish: true\ntype: benchmark\n", told=("type:benchmark\n",)),
    Container(name="a word that older servers knew", source="cyberbotics/webots#4259", yml="type: demo\ntheia:webots-project/controllers/\n", told=("type:demo\n",)),
    Container(name="a controller by name, as it was proposed", source="cyberbotics/webots-server#14",
              yml="type: benchmark\ndockerCompose: default_controller:drive\n", told=("type:benchmark\n",)),
    Container(name="a Dockerfile, as the template has it", source="cyberbotics/webots-cloud-simulation-template Dockerfile", yml="publish: true\ntype: demo\n",
              files={"Dockerfile": "FROM cyberbotics/webots.cloud:R2022b\nARG PROJECT_PATH\nCOPY . $PROJECT_PATH\nRUN cd $PROJECT_PATH/controllers && make\n"},
              told=("type:demo\n", "loading: The Dockerfile of the project is not used: this server builds with its own.")),
    Container(name="a folder that leads out", source="cyberbotics/wrestling webots.yml",
              yml="type: competition\ndockerCompose: competition:../../../etc/\n",
              says='Wrong line in webots.yml: "dockerCompose: competition:../../../etc/"'),
    Container(name="a competition without a participant's Dockerfile", source="zabarjuthy-gif/Trabalho3 webots.yml",
              yml="type: competition\ndockerCompose: competition:webots-project/controllers/participant/\n", says="A competition needs a Dockerfile in its folder controllers"),
    Container(name="a world of a year without an image", source="cyberbotics/webots-projects#18", yml="type: demo\n",
              files={"worlds/arena.wbt": world("#VRML_SIM R2021b utf8")}, says="The image can't be fetched"),
    Container(name="a world without a first line", source="cyberbotics/webots#5249", yml="type: demo\n", files={"worlds/arena.wbt": "WorldInfo {\n}\n"},
              says="The first line of the world names no version of Webots"),
    Container(name="a world that Windows has written", source="nobody's, tried here", yml="type: demo\n", files={"worlds/arena.wbt": world(ends="\r\n")},
              told=("type:demo\n",)),
]

UPGRADE = "proxy_http_version 1.1; proxy_set_header Upgrade $http_upgrade; "
PASS = "location / {{ proxy_pass http://127.0.0.1:{}; proxy_set_header Host $host:$server_port; %s}}"
FORWARDED = "proxy_set_header X-Forwarded-Proto https; "
PROXIES = [
    Proxy(name="Connection is upgrade for every request", source="nginx/nginx#1472", server="nginx",
          rules=PASS % (UPGRADE + "proxy_set_header Connection 'upgrade'; proxy_cache_bypass $http_upgrade; " + FORWARDED)),
    Proxy(name="the address of the browser is in X-Real-IP alone", source="nanocurrency/nano-node#2326", server="nginx",
          rules=PASS % (UPGRADE + 'proxy_set_header Connection "Upgrade"; proxy_set_header X-Real-IP $remote_addr; ' + FORWARDED)),
    Proxy(name="X-Forwarded-Proto is wss for WebSockets, as Traefik writes it", source="traefik/traefik#5533", server="nginx",
          rules=PASS % (UPGRADE + 'proxy_set_header Connection "upgrade"; proxy_set_header X-Forwarded-Proto $scheme_of_request; ')),
    Proxy(name="Connection is close without an upgrade", source="OctoPrint/OctoPrint#2526", server="nginx",
          rules=PASS % (UPGRADE + "proxy_set_header Connection $connection_or_close; proxy_set_header X-Scheme $scheme; " + FORWARDED)),
    Proxy(name="a name and a password in front", source="traefik/traefik#3039", server="nginx",
          rules=PASS % (UPGRADE + 'proxy_set_header Connection "upgrade"; proxy_set_header Authorization "Basic YWRhOnNlY3JldA=="; ' + FORWARDED)),
    Proxy(name="two slashes below a path", source="cyberbotics/webots#1420, erebe/wstunnel#346", server="nginx", path="/robots",
          asks="/session", says="404 .*the proxy in front has added one",
          rules="location /robots/ {{ proxy_pass http://127.0.0.1:{}//; " + UPGRADE + 'proxy_set_header Connection "upgrade"; '
          "proxy_set_header Host $host:$server_port; proxy_set_header X-Forwarded-Prefix /robots; " + FORWARDED + "}}"),
    Proxy(name="the headers of nginx-proxy", source="nginx-proxy/nginx-proxy#495, nginx-proxy/nginx-proxy#1836", server="nginx",
          rules="gzip on; gzip_types *; location / {{ proxy_pass http://127.0.0.1:{}; proxy_buffering off; " + UPGRADE +
          "proxy_set_header Host $http_host; proxy_set_header Connection $connection_or_close; proxy_set_header X-Real-IP $remote_addr; "
          'proxy_set_header X-Forwarded-For $proxy_add_x_forwarded_for; proxy_set_header X-Forwarded-Host $http_host; proxy_set_header Proxy ""; ' + FORWARDED + "}}"),
    Proxy(name="Host is $host, at another port than 443", source="nginx-proxy/nginx-proxy#2386, moltis-org/moltis#907", server="nginx",
          rules="location / {{ proxy_pass http://127.0.0.1:{}; proxy_set_header Host $host; " + UPGRADE + 'proxy_set_header Connection "upgrade"; ' + FORWARDED + "}}",
          asks="/session", says="200 wss://localhost$"),
    Proxy(name="Host is $host, and X-Forwarded-Port has the port", source="nginx-proxy/nginx-proxy#2386, nobody's port", server="nginx",
          rules="location / {{ proxy_pass http://127.0.0.1:{}; proxy_set_header Host $host; proxy_set_header X-Forwarded-Port $server_port; " + UPGRADE +
          'proxy_set_header Connection "upgrade"; ' + FORWARDED + "}}"),
    Proxy(name="HTTP/1.0, no upgrade", source="bugy/script-server#110", server="nginx", rules=PASS % FORWARDED, says='400 Can "Upgrade" only to "WebSocket"'),
    Proxy(name="a tunnel drops the header Upgrade", source="cloudflare/cloudflared#1652", server="nginx",
          rules=PASS % ("proxy_http_version 1.1; proxy_set_header Connection keep-alive; " + FORWARDED), says='400 Can "Upgrade" only to "WebSocket"'),
    Proxy(name="upgrade=websocket, as Apache has it since 2.4.47", source="ergochat/ergo#2050", server="apache",
          rules="RequestHeader setifempty X-Forwarded-Proto https\nProxyPreserveHost On\nProxyPass / http://127.0.0.1:{}/ upgrade=websocket\n"
          "ProxyPassReverse / http://127.0.0.1:{}/\n"),
    Proxy(name="a Location with upgrade=websocket below a path", source="gotify/server#638", server="apache", path="/robots",
          rules="RequestHeader set X-Forwarded-Proto https\nRequestHeader set X-Forwarded-Prefix /robots\nProxyPreserveHost On\n"
          "<Location /robots/>\nProxyPass http://127.0.0.1:{}/ upgrade=websocket retry=0 timeout=60\nProxyPassReverse http://127.0.0.1:{}/\n</Location>\n"),
    Proxy(name="rules of mod_rewrite for everything", source="magne4000/quassel-webserver#217", server="apache",
          rules="RequestHeader set X-Forwarded-Proto https\nProxyPreserveHost On\nRewriteEngine On\nRewriteCond %{{HTTP:Connection}} Upgrade [NC]\n"
          "RewriteCond %{{HTTP:Upgrade}} websocket [NC]\nRewriteRule /(.*) ws://127.0.0.1:{}/$1 [P,L]\nProxyPass / http://127.0.0.1:{}/\n"),
]

CHECKS = [
    Check(name="the methods of a server, by HAProxy", source="standardnotes/server#1038, phpmyadmin/docker#126", check=""),
    Check(name="the methods of its first page, with a version and a host", source="nobody's, tried here",
          check="OPTIONS / HTTP/1.1\n    http-check send hdr Host localhost"),
    Check(name="a version, and no host", source="haproxytech/dataplaneapi#304", check="OPTIONS / HTTP/1.1", says="session-server is DOWN L7STS.*simulation-server is DOWN L7STS"),
    Check(name="a host of the balancer's own", source="vyos/vyos-1x#3325",
          check="GET /livez\n    http-check send ver HTTP/1.1 hdr Host balancer\n    http-check expect status 200"),
    Check(name="HEAD of the first page", source="cppforlife/checkman#41", check="HEAD /"),
    Check(name="the load, as a container's health check", source="a guide to the Python servers in Docker on Windows, with haecto/Webots_Test_World",
          check="GET /load"),
]

SITE = {"server": "sim.example.org", "portRewrite": True, "debug": True}
CONFIGURATIONS = [
    Configuration(name="a site that has no key ssl behind a path", source=f"{ENGINE} config/session/fftai.json", kind="session",
                  keys={**SITE, "ssl": False, "port": 1999, "simulationServers": ["sim.example.org/2000"]}),
    Configuration(name="a machine with a folder of projects", source=f"{ENGINE} config/simulation/fftai.json", kind="simulation",
                  keys={**SITE, "ssl": False, "projectsDir": "/home/ada/webots-server/projects", "allowedRepositories": ["https://github.com/cyberbotics"]},
                  says='key "projectsDir": there is no folder'),
    Configuration(name="a machine of 2020, with monitorLogEnabled", source=f"{ENGINE} config/simulation/cyberbotics2.json", kind="simulation",
                  keys={"port": 3000, "projectsDir": "/home/ada/streaming_projects", "logDir": "log/", "monitorLogEnabled": True}, says='key "projectsDir": there is no folder'),
    Configuration(name="one repository instead of a list", source=f"{ENGINE}#7", kind="simulation",
                  keys={"server": "localhost", "ssl": False, "allowedRepositories": "https://github.com/cyberbotics"}, refused=True,
                  says=r'key "allowedRepositories".*\["https://github.com/cyberbotics"\]'),
    Configuration(name="webotsHome as in a container", source="a guide to the Python servers in Docker on Windows, with haecto/Webots_Test_World",
                  kind="simulation", refused=True,
                  keys={"server": "localhost", "ssl": False, "portRewrite": False, "port": 2000, "webotsHome": "/usr/local/webots", "notify": []},
                  says="webotsHome.*/usr/local/webots"),
    Configuration(name="the name as the guide of 2021 had it", source="cyberbotics/webots docs/guide/simulation-server.md", kind="simulation",
                  keys={"port": 2000, "ssl": True, "fullyQualifiedDomainName": "sim.example.org", "portRewrite": True, "logDir": "log/", "debug": True}),
    Configuration(name="mails as the guide has them", source="cyberbotics/webots docs/guide/session-server.md", kind="session",
                  keys={"port": 1999, "ssl": True, "portRewrite": True, "server": "sim.example.org", "administrator": "admin@example.org",
                  "mailServer": "mail.example.org",
                        "mailServerPort": 587, "mailSender": "support@example.org", "mailSenderPassword": "********",
                        "simulationServers": ["sim.example.org/2000"]}),
    Configuration(name="the folder of one project as projectsDir", source="cyberbotics/webots#2966", kind="simulation",
                  keys={"port": 2001, "ssl": False, "projectsDir": "/path/to/my/own/webots/project"}, says='key "projectsDir": there is no folder'),
    Configuration(name="an asterisk in hostNames", source="the issue", kind="session",
                  keys={"server": "localhost", "ssl": False, "portRewrite": False, "hostNames": ["*.example.org"], "simulationServers": ["localhost:2000"]},
                  refused=True, says='key "hostNames", entry 1: expected a whole name'),
    Configuration(name="a port where a path is meant", source="cyberbotics/webots#1420", kind="session",
                  keys={"server": "sim.example.org", "ssl": True, "portRewrite": True, "simulationServers": ["sim.example.org:2000"]}, says="good"),
]

ELSEWHERE = [
    Elsewhere(name="links of GitHub, GitLab, Gitea, Forgejo, Bitbucket", source="the issue", file="integration/git_source_test.py",
              words="test_links_of_all_forges_lead_to_the_same_project"),
    Elsewhere(name="raw.githubusercontent.com and media.githubusercontent.com", source="cyberbotics/webots#6206",
              file="unit/core/projects/project_ref_test.cpp", words="links_of_every_forge_are_understood"),
    Elsewhere(name="a zip with a repository in it", source="jelmer/dulwich#1226", file="integration/website_test.py",
              words="test_names_that_could_do_harm_are_left_out_and_the_author_is_told"),
    Elsewhere(name="a list of worlds without the rest of the repository", source="the issue", file="integration/world_lists_test.py",
              words="test_a_repository_has_a_list_with_titles_and_each_world_of_it_can_be_started"),
    Elsewhere(name="badges of READMEs", source="cyberbotics/competition-template README.md", file="viewer/viewer_test.py",
              words="test_links_of_other_sites_and_badges_lead_to_the_world_that_they_name"),
    Elsewhere(name="folders of official competitions", source="cyberbotics/wrestling webots.yml", file="integration/docker_test.py",
              words="test_a_participant_of_an_official_competition_prints_in_the_browser"),
    Elsewhere(name="sites below a path", source="the issue", file="integration/sites_below_a_path_test.py",
              words="test_two_servers_have_paths_as_with_the_python_servers"),
    Elsewhere(name="Apache's rules of the guide", source="cyberbotics/webots docs/guide/session-server.md", file="integration/proxies_test.py",
              words="test_the_rules_of_the_guide_carry_it_too_and_the_monitor_page_finds_its_way"),
    Elsewhere(name="a controller on another machine, as of ROS 2", source="cyberbotics/webots_ros2#906", file="integration/controllers_test.py",
              words="test_a_controller_drives_a_robot_in_a_sandbox_with_a_network_of_its_own"),
    Elsewhere(name="controllers by the robot's name, of old and new libraries", source="cyberbotics/webots#4518", file="integration/controllers_test.py",
              words="test_robots_are_reached_by_their_names_whatever_these_are_and_however_the_library_sends_them"),
    Elsewhere(name="a controller of a robot that another one has", source="cyberbotics/webots_ros2#684", file="integration/controllers_test.py",
              words="test_who_is_not_let_in_hears_webots_own_words"),
    Elsewhere(name="seven pictures behind one port", source="the issue", file="e2e/many_pictures_test.py", words="def test_"),
    Elsewhere(name="a leading slash in a sparse checkout", source=f"{ENGINE}#33", file="integration/git_cone_test.py",
              words="test_a_project_has_what_git_checks_out"),
    Elsewhere(name="Webots' viewer opened from disk", source="cyberbotics/webots#2966", file="integration/broken_configurations_test.py",
              words="test_a_session_server_of_this_machine_says_how_pages_from_disk_get_in"),
]

ROWS = LINKS + TYPED + PASTED + TREES + DOCKER + PROXIES + CHECKS + CONFIGURATIONS + ELSEWHERE
assert len({(type(row), row.name) for row in ROWS}) == len(ROWS), "two rows have the same name"
