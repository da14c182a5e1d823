# The target `site` builds what ./server.sh start runs, and nothing else: the servers, the programs that they start, and the example of a website.
# What one of these needs is not built without being named here, so a name that is no target stops CMake.
add_custom_target(site)
add_dependencies(site
    webots-session-server
    webots-simulation-server
    webots-process-guard
    webots-demo-simulator
    webots-site
    webots-website-host)
