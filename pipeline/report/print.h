#pragma once
/// The first sheet of report.html as a PDF of one A4 page, by a headless Chromium.
#include <filesystem>

namespace wireplan::pipeline {

/// The browser that WIREPLAN_CHROMIUM names, else the first of chromium, chromium-browser,
/// google-chrome and google-chrome-stable on the PATH. Throws `Error` where there is none.
std::filesystem::path find_browser();

/// Prints the sheet of the page beside a report into `folder` as sheet.pdf, which it returns. The
/// browser is started without a shell, with a profile of its own that is removed afterwards, and is
/// ended where it takes more than a minute. Throws `Error` where there is no page, or one without a
/// sheet, no browser, or it prints nothing.
std::filesystem::path print_sheet(const std::filesystem::path& report,
                                  const std::filesystem::path& folder);

}  // namespace wireplan::pipeline
