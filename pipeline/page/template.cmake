# Target `pipeline` gets page_template.h: the template of report.html, or the reason why there is
# none. WIREPLAN_PAGE_WORK is the folder with the page's npm packages, empty without a template.
set(page_header ${CMAKE_CURRENT_BINARY_DIR}/page_template.h)
set(page_missing "")
if(WIREPLAN_PAGE)
  find_program(WIREPLAN_NODE NAMES node nodejs)               # nodejs
  find_program(WIREPLAN_NPM npm)                              # npm
  if(WIREPLAN_NODE AND WIREPLAN_NPM)
    execute_process(COMMAND ${WIREPLAN_NODE} --version OUTPUT_VARIABLE node_version OUTPUT_STRIP_TRAILING_WHITESPACE)
    string(REGEX REPLACE "^v" "" node_version "${node_version}")
    if(node_version VERSION_LESS 18)
      set(page_missing "wireplan was built with Node ${node_version}, which is older than 18")
    endif()
  else()
    set(page_missing "wireplan was built without Node (packages nodejs and npm)")
  endif()
  if(page_missing)
    message(NOTICE "report.html: ${page_missing}; reports will have no page, JSON and pictures only.")
  endif()
else()
  set(page_missing "wireplan was built with WIREPLAN_PAGE=OFF")
endif()

if(page_missing)
  set(WIREPLAN_PAGE_WORK "" CACHE INTERNAL "")
  file(CONFIGURE OUTPUT ${page_header} CONTENT [[
#pragma once
inline constexpr const char* kPageTemplate = "";
inline constexpr const char* kPageMissing = "@page_missing@";
]] @ONLY)
else()
  set(WIREPLAN_PAGE_WORK ${CMAKE_CURRENT_BINARY_DIR}/page CACHE INTERNAL "")
  file(GLOB page_sources CONFIGURE_DEPENDS page/*.mjs page/*.json page/src/*)
  set(page_stamp ${CMAKE_CURRENT_BINARY_DIR}/page.stamp)
  add_custom_command(OUTPUT ${page_stamp} BYPRODUCTS ${page_header}
    COMMAND ${CMAKE_COMMAND} -DSOURCE=${CMAKE_CURRENT_SOURCE_DIR}/page -DWORK=${WIREPLAN_PAGE_WORK}
      -DHEADER=${page_header} -DSTAMP=${page_stamp} -DNODE=${WIREPLAN_NODE} -DNPM=${WIREPLAN_NPM}
      -P ${CMAKE_CURRENT_SOURCE_DIR}/page/build.cmake
    DEPENDS ${page_sources} page/build.cmake COMMENT "Bundling the page of report.html")
  add_custom_target(page_template DEPENDS ${page_stamp})
  add_dependencies(pipeline page_template)
endif()
