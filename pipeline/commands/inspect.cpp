#include "pipeline/report/inspect.h"

#include <iostream>
#include <memory>

#include "pipeline/commands/commands.h"
#include "pipeline/commands/subcommands.h"

namespace wireplan::pipeline {

void add_inspect(CLI::App& app, int& code) {
  struct Arguments {
    std::string path;
    bool as_json = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("inspect", "What a CT, a label volume or a surface holds");
  command->add_option("PATH", arguments->path, "Folder of DICOM files, volume or surface")
      ->required();
  command->add_flag("--json", arguments->as_json, "As JSON (wireplan.inspect/1)");
  command->footer(
      "Series, sizes, units, orientation, labels, extents; and why a case would refuse it.\n"
      "Never who the patient is. Exits 2 where a case refuses it, or nothing can be told.\n"
      "Example: wireplan inspect cases/abdomen/data/ct.nrrd");
  command->callback([&code, arguments] {
    const Json told = inspect(arguments->path);
    // A header may hold bytes of any kind.
    std::cout << (arguments->as_json
                      ? told.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"
                      : inspect_text(told));
    code = is_refused(told) ? kBadInput : kDone;
  });
}

}  // namespace wireplan::pipeline
