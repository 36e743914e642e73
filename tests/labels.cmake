# Read by ctest once the slow tests are listed: each has two labels, its folder and "slow".
# gtest_discover_tests cannot set them: it passes on a list as words and takes the first as the label.
foreach(folder simulate plan preprocess pipeline)
  if(slow_${folder})
    set_tests_properties(${slow_${folder}} PROPERTIES LABELS "${folder};slow")
  endif()
endforeach()
