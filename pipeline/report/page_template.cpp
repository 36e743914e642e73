// What was made of page/, in a file of its own: a change there compiles this one again.
#include <page_template.h>

#include "pipeline/report/page.h"

namespace wireplan::pipeline {

std::string page_template() { return kPageTemplate; }
std::string page_missing() { return kPageMissing; }

}  // namespace wireplan::pipeline
