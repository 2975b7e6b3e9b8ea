# SPDX-License-Identifier: Apache-2.0
# WM_PORTABLE: programs that need nothing of the image they run on, not even its glibc. For boards whose glibc is older than
# what Debian 12's compilers link to. Libraries that Debian has no static form of come from toolchain/portable.sh.
if(CMAKE_CROSSCOMPILING)
  set(arch ${WM_ARCH})
else()
  set(arch amd64)
endif()
set(portable ${CMAKE_SOURCE_DIR}/.cache/portable/${arch})
get_filename_component(portable ${portable} REALPATH)
if(NOT EXISTS ${portable}/.complete)
  message(FATAL_ERROR "There are no static libraries in ${portable}. Make them: bash toolchain/portable.sh ${arch}")
endif()
set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
list(PREPEND CMAKE_FIND_ROOT_PATH ${portable})
list(PREPEND CMAKE_PREFIX_PATH / ${portable})
# Our malloc, which counts, stands before that of glibc (firmware/rt); in a static program both are there.
# glibc has no start code of a static program at any address for 32-bit ARM (rcrt1.o): there it is at a fixed one.
if(arch STREQUAL armhf)
  add_link_options(-static -Wl,-z,muldefs)
else()
  add_link_options(-static-pie -Wl,-z,muldefs)
endif()
