# The message packages that come as Python wheels name include directories of the machine that built them, and CMake refuses
# an imported target whose include directory does not exist. Taking those names off is right everywhere: a directory that
# does not exist holds no header. With a ROS install there is nothing to take off.
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
