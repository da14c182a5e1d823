# What dpkg-buildflags turns on for Debian's packages with hardening=+bindnow, in Debian 13, which has two more than Debian 12: copies into
# buffers of known size are checked, stacks have canaries and do not grow past their guard pages, indirect jumps land where they may (on
# x86), and the tables of the dynamic linker are read-only before the program begins. server.sh turns it on for packages;
# docs/performance.md says what it costs. tests/packaging/debian_packages_test.py compares it with dpkg-buildflags.
option(WEBOTS_CLOUD_HARDENING "Compile and link as dpkg-buildflags with hardening=+bindnow says" OFF)
if(WEBOTS_CLOUD_HARDENING)
    # Compilers of some distributions define _FORTIFY_SOURCE themselves.
    add_compile_options(-fstack-protector-strong -fstack-clash-protection -Wformat -Werror=format-security -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2)
    if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
        add_compile_options(-fcf-protection)
    endif()
    add_link_options(LINKER:-z,relro LINKER:-z,now)
endif()
