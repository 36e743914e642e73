# Read by ctest once all tests are listed: each has two labels, its folder and "fast" or "slow".
# gtest_discover_tests cannot set them: it passes on a list as words and takes the first as the label.
foreach(folder simulate plan preprocess pipeline)
  foreach(speed fast slow)
    if(${speed}_${folder})
      set_tests_properties(${${speed}_${folder}} PROPERTIES LABELS "${folder};${speed}")
    endif()
  endforeach()
endforeach()
