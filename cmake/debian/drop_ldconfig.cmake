# Run by CPack when the packages are made: takes the maintainer scripts out of that of the shared library, which do nothing but call
# ldconfig. dpkg does that by the package's trigger.
foreach(package IN LISTS CPACK_PACKAGE_FILES)
    if(NOT package MATCHES "/libwebots-cloud[0-9]+_[^/]*\\.deb$")
        continue()
    endif()
    set(tree ${package}.tree)
    execute_process(COMMAND dpkg-deb --raw-extract ${package} ${tree} COMMAND_ERROR_IS_FATAL ANY)
    file(REMOVE ${tree}/DEBIAN/postinst ${tree}/DEBIAN/postrm)
    execute_process(COMMAND dpkg-deb --build --root-owner-group ${tree} ${package} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
    file(REMOVE_RECURSE ${tree})
endforeach()
