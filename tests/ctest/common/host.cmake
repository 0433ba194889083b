# What the programs of both libraries share: languages, warnings, and how a program is a test.
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_STANDARD_REQUIRED ON)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
add_compile_options(-Wall -Wextra -Wpedantic -Wshadow -Werror)
add_compile_definitions(_POSIX_C_SOURCE=200809L)
set(COMMON ${CMAKE_CURRENT_LIST_DIR})
set(EXAMPLES ${COMMON}/../../../examples/c)
include_directories(${COMMON})
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)
enable_testing()

# Versions of a package other than the installed one are not taken for it.
function(refuse_versions package)
  foreach(other ${ARGN})
    find_package(${package} ${other} QUIET)
    if(${package}_FOUND)
      message(FATAL_ERROR "version ${other} of ${package} is not installed, but was found")
    endif()
    unset(${package}_DIR CACHE)
  endforeach()
endfunction()

# program(NAME SOURCE LIBRARY...): a test of that name, which also links what all of them need and may take LIMIT seconds.
function(program name source)
  add_executable(${name} ${source})
  target_link_libraries(${name} PRIVATE ${ARGN} ${NEEDED})
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${LIMIT})
endfunction()

# A plug-in that holds the archive, found in two ways, exports its own function, and none of the archive's.
function(plugins archive pkgconfig)
  add_library(plugin MODULE plugin.c)
  target_link_libraries(plugin PRIVATE ${archive})
  add_library(plugin_pkgconfig MODULE plugin.c)
  target_compile_options(plugin_pkgconfig PRIVATE ${${pkgconfig}_CFLAGS})
  target_link_libraries(plugin_pkgconfig PRIVATE ${${pkgconfig}_LDFLAGS})
  program(plugin_host ${COMMON}/plugin_host.c ${CMAKE_DL_LIBS})
  target_compile_definitions(plugin_host PRIVATE PLUGINS="$<TARGET_FILE:plugin>","$<TARGET_FILE:plugin_pkgconfig>")
  add_dependencies(plugin_host plugin plugin_pkgconfig)
endfunction()

# The library comes and goes while the program runs.
function(load_cycles library)
  get_target_property(file ${library} IMPORTED_LOCATION)
  program(load_cycles load_cycles.c ${CMAKE_DL_LIBS})
  target_include_directories(load_cycles PRIVATE $<TARGET_PROPERTY:${library},INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_definitions(load_cycles PRIVATE ${ARGN} FRAZIL_FILE="${file}")
endfunction()

# Every link of the installed manual leads to a file.
function(manual_links manual)
  add_test(NAME manual_links COMMAND sh ${COMMON}/manual_links.sh ${manual})
endfunction()
