# SPDX-License-Identifier: Apache-2.0
# Run by CPack between staging and packing.
set(staged ${CPACK_TEMPORARY_DIRECTORY}/runtime)
if(IS_DIRECTORY ${staged}/usr/etc)
  file(REMOVE_RECURSE ${staged}/etc)
  file(RENAME ${staged}/usr/etc ${staged}/etc)
endif()
