# xacro_add_files(FILE... [OUTPUT FILE] [TARGET NAME] [REMAP NAME:=VALUE...] [DEPENDS FILE...] [INORDER]
#                 [INSTALL [DESTINATION FOLDER]])
#
# Expands xacro files when the workspace is built, as the function of this name of ROS's xacro; INORDER is always so.
set(vrx_mj_xacro "${CMAKE_CURRENT_LIST_DIR}/../xacro")

function(xacro_add_files)
  cmake_parse_arguments(ARG "INORDER;INSTALL" "OUTPUT;TARGET;DESTINATION" "REMAP;DEPENDS" ${ARGN})
  set(outputs)
  foreach(file ${ARG_UNPARSED_ARGUMENTS})
    set(output "${ARG_OUTPUT}")
    if(NOT output)
      string(REGEX REPLACE "\\.xacro$" "" output "${file}")
    endif()
    get_filename_component(output "${output}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_BINARY_DIR}")
    get_filename_component(folder "${output}" DIRECTORY)
    get_filename_component(input "${file}" ABSOLUTE)
    add_custom_command(
      OUTPUT "${output}"
      COMMAND ${CMAKE_COMMAND} -E make_directory "${folder}"
      COMMAND ${CATKIN_ENV} "${vrx_mj_xacro}" -o "${output}" "${input}" ${ARG_REMAP}
      DEPENDS "${input}" ${ARG_DEPENDS})
    list(APPEND outputs "${output}")
  endforeach()
  if(NOT ARG_TARGET)
    string(MAKE_C_IDENTIFIER "${PROJECT_NAME}_${ARG_UNPARSED_ARGUMENTS}_xacro" ARG_TARGET)
  endif()
  add_custom_target(${ARG_TARGET} ALL DEPENDS ${outputs})
  if(ARG_INSTALL)
    set(share "${CATKIN_PACKAGE_SHARE_DESTINATION}/${ARG_DESTINATION}")
    add_custom_command(TARGET ${ARG_TARGET} POST_BUILD
      COMMAND ${CMAKE_COMMAND} -E make_directory "${CATKIN_DEVEL_PREFIX}/${share}"
      COMMAND ${CMAKE_COMMAND} -E copy ${outputs} "${CATKIN_DEVEL_PREFIX}/${share}")
    install(FILES ${outputs} DESTINATION "${share}")
  endif()
endfunction()
