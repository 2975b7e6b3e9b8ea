# SPDX-License-Identifier: Apache-2.0
# cmake -DOUT=page.cpp -DFILES="a.html;b.css" -P embed.cmake: the files as bytes in a program (wm::tools::kPageFiles).
set(arrays "")
set(entries "")
set(number 0)
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  file(READ ${file} content HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," content "${content}")
  string(APPEND arrays "constexpr unsigned char kFile${number}[] = {${content}};\n")
  string(APPEND entries "    {\"${name}\", std::string(std::begin(kFile${number}), std::end(kFile${number}))},\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE ${OUT} "// Made from the page's files.\n#include \"web/page.h\"\n\n#include <iterator>\n\nnamespace wm::tools {\nnamespace {\n${arrays}}  // namespace\n"
  "const std::map<std::string, std::string> kPageFiles = {\n${entries}};\n}  // namespace wm::tools\n")
