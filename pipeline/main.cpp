/// wireplan: exit codes and what the user reads when something goes wrong; nothing else.
#include <filesystem>
#include <iostream>

#include "pipeline/commands.h"
#include "pipeline/stage_work.h"

int main(int argc, char** argv) {
  using namespace wireplan;
  try {
    return pipeline::run_command(argc, argv);
  } catch (const Error& error) {
    std::cerr << error.what() << "\n";
    return pipeline::kBadInput;
  } catch (const std::filesystem::filesystem_error& error) {
    std::cerr << error.what() << "; check the disk's space and the folder's permissions\n";
    return pipeline::kBadInput;
  } catch (const pipeline::Interrupted& stop) {
    std::cerr << stop.what() << "\n";
    return pipeline::kInterrupted;
  } catch (const std::exception& error) {
    std::cerr << "internal error, please report it: " << error.what() << "\n";
    return pipeline::kOurFault;
  }
}
