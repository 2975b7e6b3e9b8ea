# SPDX-License-Identifier: Apache-2.0
# Run by CPack at its start: the time of files and folders in packages is that of the commit, outside of a repository that
# of the newest version in the packages' changelog.
if(NOT DEFINED ENV{SOURCE_DATE_EPOCH})
  execute_process(COMMAND ${CMAKE_CURRENT_LIST_DIR}/../toolchain/source_date.sh OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
  set(ENV{SOURCE_DATE_EPOCH} ${date})
endif()
