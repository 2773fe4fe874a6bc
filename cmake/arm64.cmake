# Toolchain: Debian's g++ for 64-bit Arm, with the libraries that scripts/arm64-sysroot unpacks. What
# the build runs of what it made runs in qemu-aarch64.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_SYSROOT ${CMAKE_CURRENT_LIST_DIR}/../build/arm64-sysroot)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
# They name that folder's loader themselves: qemu's own way, -L, puts the folder before every path that
# a program opens.
get_filename_component(sysroot ${CMAKE_SYSROOT} REALPATH)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,--dynamic-linker=${sysroot}/lib/ld-linux-aarch64.so.1")
set(CMAKE_CROSSCOMPILING_EMULATOR
  "qemu-aarch64-static;-E;LD_LIBRARY_PATH=${sysroot}/lib/aarch64-linux-gnu:${sysroot}/usr/lib/aarch64-linux-gnu")
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${CMAKE_SYSROOT}/usr/share/pkgconfig)
