# Read right after project(), by CMAKE_PROJECT_<name>_INCLUDE; colcon never does.
#
# Targets of the wheels of ROS name include directories of the machine that built them, and CMake refuses
# a target with one that is not there.

function(_keep_present_includes)
  get_property(targets DIRECTORY PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(includes ${target} INTERFACE_INCLUDE_DIRECTORIES)
    if(includes)
      set(present)
      foreach(include IN LISTS includes)
        if(include MATCHES "\\$<" OR EXISTS "${include}")
          list(APPEND present "${include}")
        endif()
      endforeach()
      set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${present}")
    endif()
  endforeach()
endfunction()

cmake_language(DEFER CALL _keep_present_includes)
