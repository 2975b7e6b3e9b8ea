# SPDX-License-Identifier: Apache-2.0
# Run by CPack when the packages are written.
execute_process(COMMAND python3 ${CMAKE_CURRENT_LIST_DIR}/../toolchain/package/ar_modes.py ${CPACK_PACKAGE_FILES} COMMAND_ERROR_IS_FATAL ANY)
