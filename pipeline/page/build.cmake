# Makes page_template.h of the page's sources with Node: copies SOURCE to WORK, installs the packages
# of package-lock.json there and bundles. Where that fails (no network, say), says so and writes a
# header without a template, so that wireplan is built all the same; the next build tries again.
#   cmake -DSOURCE=... -DWORK=... -DHEADER=... -DSTAMP=... -DNODE=... -DNPM=... -P build.cmake
set(missing "")
file(COPY ${SOURCE}/ DESTINATION ${WORK} PATTERN node_modules EXCLUDE)
# The packages stay where they are until the list of them changes.
set(failed 0)
set(installed "")
file(READ ${SOURCE}/package-lock.json wanted)
if(EXISTS ${WORK}/installed.json)
  file(READ ${WORK}/installed.json installed)
endif()
if(NOT wanted STREQUAL installed)
  file(REMOVE ${WORK}/installed.json)
  execute_process(COMMAND ${NPM} ci --no-progress --loglevel=error WORKING_DIRECTORY ${WORK}
    RESULT_VARIABLE failed OUTPUT_VARIABLE log ERROR_VARIABLE log)
endif()
if(failed)
  set(missing "npm ci failed while wireplan was built")
else()
  configure_file(${SOURCE}/package-lock.json ${WORK}/installed.json COPYONLY)
  execute_process(COMMAND ${NODE} build.mjs ${WORK} WORKING_DIRECTORY ${WORK}
    RESULT_VARIABLE failed OUTPUT_VARIABLE log ERROR_VARIABLE log)
  if(failed)
    set(missing "the page's scripts could not be bundled while wireplan was built")
  endif()
endif()
if(missing)
  message("${log}\nreport.html: ${missing}; reports will have no page, JSON and pictures only. "
    "Mend this (see above) and build again, or configure with -DWIREPLAN_PAGE=OFF.")
  file(WRITE ${WORK}/page_template.h "#pragma once\n"
    "inline constexpr const char* kPageTemplate = \"\";\n"
    "inline constexpr const char* kPageMissing = \"${missing}\";\n")
  file(REMOVE ${WORK}/template.html ${STAMP})
else()
  file(TOUCH ${STAMP})
endif()
configure_file(${WORK}/page_template.h ${HEADER} COPYONLY)
