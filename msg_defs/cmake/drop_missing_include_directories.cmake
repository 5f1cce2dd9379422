# The message packages that come as Python wheels list include directories of the machine that built them. CMake rejects an
# imported target whose include directory does not exist, so the missing ones are removed here. In a ROS installation all of
# them exist and nothing is removed.
get_directory_property(imported_targets IMPORTED_TARGETS)
foreach(target IN LISTS imported_targets)
  get_target_property(directories ${target} INTERFACE_INCLUDE_DIRECTORIES)
  if(NOT directories)
    continue()
  endif()
  set(existing)
  foreach(directory IN LISTS directories)
    if(directory MATCHES "^\\$<" OR EXISTS "${directory}")
      list(APPEND existing "${directory}")
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${existing}")
endforeach()
