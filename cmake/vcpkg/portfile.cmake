# An overlay port: vcpkg install webots-cloud --overlay-ports=cmake/vcpkg (from a checkout). It has never been run: Debian has no vcpkg.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../.." ABSOLUTE)
vcpkg_check_features(OUT_FEATURE_OPTIONS FEATURE_OPTIONS FEATURES adapters WEBOTS_CLOUD_BUILD_ADAPTERS)
vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}" OPTIONS ${FEATURE_OPTIONS}
    -DWEBOTS_CLOUD_INSTALL=ON -DWEBOTS_CLOUD_BUILD_APPS=OFF -DWEBOTS_CLOUD_BUILD_EXAMPLES=OFF -DWEBOTS_CLOUD_BUILD_TESTS=OFF)
vcpkg_cmake_build(TARGET installable)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME webots_cloud CONFIG_PATH lib/cmake/webots_cloud)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
