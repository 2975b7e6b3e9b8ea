// SPDX-License-Identifier: Apache-2.0
// Versions of a site (docs/building.md). Each is a folder that is written beside, synced and renamed, and stays as it
// is; `current`, a file that is replaced atomically, names the one that robots take. A kill or a power cut at any
// step leaves the version before or the new one.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/failure.h"

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

// Hash of the site's own files as they are: the name that a version of them has.
std::string site_hash(const std::filesystem::path &site);

// Files that shall be other than they are: their bytes, by the path below the site's folder; none: without that file.
using FileChanges = std::map<std::string, std::optional<std::string>>;
struct VersionWish {
  std::string author, note;
  std::string base = {};     // site_hash() that the changes were made for; "": any
  FileChanges changes = {};  // the site's own files have them afterwards, too
};
struct MadeVersion {
  std::string name;
  bool is_new = false;           // else these files are a version already, which is current now
  size_t files = 0, shared = 0;  // shared: unchanged ones, which take no room of their own
};
// The files are not those that the changes were made for.
struct OutdatedBase : Failure {
  OutdatedBase(const std::filesystem::path &site, const std::string &base);
};
// Makes a version of the site's files with the changes and takes it for current. Throws Failure where something is
// wrong with them (the lines of check_floors), or another program makes one just now; then nothing has changed.
MadeVersion make_version(const std::filesystem::path &site, const VersionWish &wish);
// The site's own files after a program was killed in make_version: those of the version that became current.
void finish_version(const std::filesystem::path &site);
// Takes the version whose name begins so for current. Throws Failure where there is none, several, or it is damaged.
std::string use_version(const std::filesystem::path &site, const std::string &begin);
// Takes a version from another copy of the building, whose folder is `version` (.../versions/NAME), whole or not at
// all; it does not become current. Returns its name. Throws Failure where it is damaged, or there already.
std::string add_version(const std::filesystem::path &site, const std::filesystem::path &version);
// Removes the version whose name begins so. Throws Failure where there is none, several, or it is current.
std::string remove_version(const std::filesystem::path &site, const std::string &begin);
// Removes all but the newest `keep` versions and the current one; returns their names.
std::vector<std::string> collect_versions(const std::filesystem::path &site, size_t keep);

}  // namespace wm::tools
