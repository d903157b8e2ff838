# find_package(sdftool) makes the targets sdftool::static and sdftool::shared.
get_filename_component(sdftool_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
include(CMakeFindDependencyMacro)
find_dependency(Threads)
if(NOT TARGET sdftool::static)
  add_library(sdftool::static STATIC IMPORTED)
  set_target_properties(sdftool::static PROPERTIES
    IMPORTED_LOCATION "${sdftool_prefix}/lib/libsdftool.a"
    INTERFACE_INCLUDE_DIRECTORIES "${sdftool_prefix}/include"
    INTERFACE_LINK_LIBRARIES "Threads::Threads;${CMAKE_DL_LIBS};m")
  add_library(sdftool::shared SHARED IMPORTED)
  set_target_properties(sdftool::shared PROPERTIES
    IMPORTED_LOCATION "${sdftool_prefix}/lib/libsdftool.so"
    INTERFACE_INCLUDE_DIRECTORIES "${sdftool_prefix}/include")
endif()
unset(sdftool_prefix)
