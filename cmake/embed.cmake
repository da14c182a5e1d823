# Embeds files into the binary:  webots_cloud_embed(OUTPUT file.cpp ROOT folder FILES a b ... [EXTERNAL name=path ...])
# The generated source defines webots_cloud::web::find_asset for them (src/web/assets.hpp). EXTERNAL files lie outside of ROOT:
# libraries from elsewhere, under a name of ours. Compressed copies are made beside OUTPUT.
set(WEBOTS_CLOUD_EMBED_SCRIPT ${CMAKE_CURRENT_LIST_DIR}/embed_files.cmake)

function(webots_cloud_embed)
    cmake_parse_arguments(EMBED "" "OUTPUT;ROOT" "FILES;EXTERNAL" ${ARGN})
    list(TRANSFORM EMBED_FILES PREPEND "${EMBED_ROOT}/" OUTPUT_VARIABLE paths)
    list(TRANSFORM EMBED_EXTERNAL REPLACE "^[^=]*=" "" OUTPUT_VARIABLE external_paths)
    # In a file, since folders may have any characters in their names, and commands don't take them all.
    set(list "${EMBED_OUTPUT}.list")
    list(JOIN EMBED_FILES "\n" files)
    list(JOIN EMBED_EXTERNAL "\n" external)
    file(GENERATE OUTPUT "${list}" CONTENT "${files}\n${external}\n")
    add_custom_command(
        OUTPUT ${EMBED_OUTPUT}
        COMMAND ${CMAKE_COMMAND} -DOUTPUT=${EMBED_OUTPUT} -DROOT=${EMBED_ROOT} -DLIST=${list} -P ${WEBOTS_CLOUD_EMBED_SCRIPT}
        DEPENDS ${paths} ${external_paths} ${list} ${WEBOTS_CLOUD_EMBED_SCRIPT}
        COMMENT "Embedding the web pages"
        VERBATIM)
    # The compiler does not tell that the assembler reads these files, too.
    set_source_files_properties(${EMBED_OUTPUT} PROPERTIES OBJECT_DEPENDS "${paths};${external_paths}")
endfunction()
