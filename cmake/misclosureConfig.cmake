# An effect of one's own in a CMake project:
#
#   find_package(misclosure REQUIRED)
#   misclosure_add_effect(sensor-pattern sensor-pattern.h)     # sensor-pattern.so, for --plugin
#
# misclosure::effect is the contract alone, for a test of the formula (effect_test.h).
include(CMakeFindDependencyMacro)
find_dependency(Eigen3 NO_MODULE)

get_filename_component(misclosure_INCLUDE_DIR "${CMAKE_CURRENT_LIST_DIR}/../../../include/misclosure" ABSOLUTE)
find_path(misclosure_CERES_INCLUDE_DIR ceres/jet.h)
if(NOT misclosure_CERES_INCLUDE_DIR)
  set(misclosure_FOUND FALSE)
  set(misclosure_NOT_FOUND_MESSAGE "ceres/jet.h not found: install libceres-dev")
  return()
endif()

if(NOT TARGET misclosure::effect)
  add_library(misclosure::effect INTERFACE IMPORTED)
  set_target_properties(misclosure::effect PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${misclosure_INCLUDE_DIR};${misclosure_CERES_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES Eigen3::Eigen
    INTERFACE_COMPILE_FEATURES cxx_std_17)
endif()

# NAME.so from a header: one effect, as `misclosure effects build` compiles it.
function(misclosure_add_effect name header)
  get_filename_component(header "${header}" ABSOLUTE)
  set(source "${CMAKE_CURRENT_BINARY_DIR}/${name}.plugin.cc")
  file(CONFIGURE OUTPUT "${source}" CONTENT "#include \"${header}\"\n")
  add_library(${name} MODULE "${source}")
  set_target_properties(${name} PROPERTIES PREFIX "" SUFFIX ".so" CXX_VISIBILITY_PRESET hidden)
  target_compile_definitions(${name} PRIVATE MISCLOSURE_PLUGIN)
  target_link_libraries(${name} PRIVATE misclosure::effect)
  # Without optimisation a call costs a hundred times as much.
  if(NOT CMAKE_BUILD_TYPE)
    target_compile_options(${name} PRIVATE -O3)
  endif()
endfunction()
