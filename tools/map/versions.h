// SPDX-License-Identifier: Apache-2.0
// Versions of a site (docs/building.md). Each is a folder that is written beside, synced and renamed, and stays as it
// is; `current`, a file that is replaced atomically, names the one that robots take. A kill or a power cut at any
// step leaves the version before or the new one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace wm::tools {

struct VersionListed {
  std::string name, base, date, author, note;
  size_t files = 0;
  bool is_current = false;
  std::string damage;  // what is wrong with it, with its path; "": nothing
};
// By date. The hash of each file is compared.
std::vector<VersionListed> list_versions(const std::filesystem::path &site);
std::string version_line(const VersionListed &version);
// "the site's files differ from the current version ..."; "" where they don't, or where there is no version.
std::string draft_against_current(const std::filesystem::path &site);

struct MadeVersion {
  std::string name;
  bool is_new = false;           // else these files are a version already, which is current now
  size_t files = 0, shared = 0;  // shared: unchanged ones, which take no room of their own
};
// Makes a version of the site's files and takes it for current. Throws Failure where something is wrong with them (the
// lines of check_floors), or another program makes one just now.
MadeVersion make_version(const std::filesystem::path &site, const std::string &author, const std::string &note);
// Takes the version whose name begins so for current. Throws Failure where there is none, several, or it is damaged.
std::string use_version(const std::filesystem::path &site, const std::string &begin);
// Removes all but the newest `keep` versions and the current one; returns their names.
std::vector<std::string> collect_versions(const std::filesystem::path &site, size_t keep);

}  // namespace wm::tools
