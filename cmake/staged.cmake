# SPDX-License-Identifier: Apache-2.0
# Run by CPack between staging and packing.
set(staged ${CPACK_TEMPORARY_DIRECTORY}/runtime)
# /usr is the prefix; what is below /usr/etc for CMake is in /etc for Debian.
if(IS_DIRECTORY ${staged}/usr/etc)
  file(REMOVE_RECURSE ${staged}/etc)
  file(RENAME ${staged}/usr/etc ${staged}/etc)
endif()
# Folders that no rule names have the mode of this user's umask.
file(GLOB_RECURSE entries LIST_DIRECTORIES true ${CPACK_TEMPORARY_DIRECTORY}/*)
foreach(entry ${entries})
  if(IS_DIRECTORY ${entry} AND NOT IS_SYMLINK ${entry})
    file(CHMOD ${entry} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  endif()
endforeach()
