// In the place of page_template.cpp: as a program that was built without Node.
#include "pipeline/report/page.h"

namespace wireplan::pipeline {

std::string page_template() { return ""; }
std::string page_missing() { return "this program is built for tests, without a page"; }

}  // namespace wireplan::pipeline
