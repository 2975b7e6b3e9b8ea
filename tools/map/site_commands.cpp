// SPDX-License-Identifier: Apache-2.0
#include "map/site_commands.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "common/failure.h"
#include "map/site.h"
#include "map/versions.h"

namespace wm::tools {

namespace fs = std::filesystem;

int check_site_command(const std::string &site) {
  const SiteReport report = check_site(site);
  for (const std::string &line : report.facts) std::printf("%s\n", line.c_str());
  for (const std::string &line : report.wrong) std::printf("wrong: %s\n", line.c_str());
  for (const std::string &line : report.odd) std::printf("odd: %s\n", line.c_str());
  if (report.wrong.empty()) std::printf("good\n");
  return report.wrong.empty() ? kDone : kFailed;
}

void parse_version(cli::App &app, VersionArguments &a) {
  app.description(
      "Makes a version of a building's maps, which robots take from then on; lists versions, goes back to one.");
  app.add_option("SITE", a.site, "the building's folder, with site.yaml; or a folder with one map")->required();
  app.add_option("--author", a.author, "who makes it; without: the user's name");
  app.add_option("--note", a.note, "what has changed");
  auto *list = app.add_flag("--list", a.list, "prints the versions; * is the one that robots take");
  auto *use = app.add_option("--use", a.use, "the version that robots take: its name, or how that begins");
  app.add_option("--keep", a.keep, "removes all but the newest so many versions and the current one")
      ->check(cli::range(1, 100000))
      ->excludes("--use")
      ->excludes("--list");
  app.add_option("--add", a.add,
                 "takes a version from another copy of the building: its folder; robots go on with the one before")
      ->excludes("--list")
      ->excludes("--use")
      ->excludes("--keep");
  app.add_option("--remove", a.remove, "removes a version that robots don't take: its name, or how that begins")
      ->excludes("--list")
      ->excludes("--use")
      ->excludes("--keep")
      ->excludes("--add");
  (void)list;
  use->excludes("--list");
  app.footer(
      "examples:\n"
      "  waymark map version office --author Jane --note 'lift B added'\n"
      "  waymark map version office --list\n"
      "  waymark map version office --use 1f3a\n"
      "  waymark map version office --add /media/stick/office/versions/118f93d443b3ade5\n"
      "A version's name is the hash of its files; an older one stays until --keep removes it. A kill or a power cut\n"
      "leaves the version before or the new one. More: docs/building.md.\n"
      "Exit code: 0 done, 1 something is wrong with the maps, 2 usage.");
}

namespace {

int list(const std::string &site) {
  const std::vector<VersionListed> all = list_versions(site);
  bool is_good = true;
  for (const VersionListed &version : all) {
    if (version.damage.empty())
      std::printf("%s\n", version_line(version).c_str());
    else
      std::printf("wrong: %s\n", version.damage.c_str());
    is_good &= version.damage.empty();
  }
  if (all.empty()) std::printf("%s: has no versions; robots take its files\n", site.c_str());
  if (const std::string line = is_good ? draft_against_current(site) : ""; !line.empty())
    std::printf("%s\n", line.c_str());
  return is_good ? kDone : kFailed;
}

std::string user() {
  const char *name = std::getenv("USER");
  return name != nullptr && *name != '\0' ? name : "unknown";
}

}  // namespace

int version_command(const VersionArguments &a) {
  if (!fs::is_directory(fs::path(a.site) / "versions") && a.add.empty()) (void)read_floors(a.site);  // a site?
  if (a.list) return list(a.site);
  if (!a.use.empty()) {
    std::printf("%s: version %s is current\n", a.site.c_str(), use_version(a.site, a.use).c_str());
    return kDone;
  }
  if (!a.add.empty()) {
    std::printf("%s: version %s is there\n", a.site.c_str(), add_version(a.site, a.add).c_str());
    return kDone;
  }
  if (!a.remove.empty()) {
    std::printf("%s: version %s removed\n", a.site.c_str(), remove_version(a.site, a.remove).c_str());
    return kDone;
  }
  if (a.keep > 0) {
    for (const std::string &name : collect_versions(a.site, static_cast<size_t>(a.keep)))
      std::printf("%s: version %s removed\n", a.site.c_str(), name.c_str());
    return kDone;
  }
  const MadeVersion made = make_version(a.site, {a.author.empty() ? user() : a.author, a.note});
  if (made.is_new)
    std::printf("%s: version %s, %zu files (%zu as before)\n  robots take it at their next start or reload\n",
                a.site.c_str(), made.name.c_str(), made.files, made.shared);
  else
    std::printf("%s: these files are version %s already; it is current\n", a.site.c_str(), made.name.c_str());
  return kDone;
}

}  // namespace wm::tools
