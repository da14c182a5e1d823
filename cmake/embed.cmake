# Embeds files into the binary:  webots_cloud_embed(OUTPUT file.cpp ROOT folder FILES a b ... [EXTERNAL name=path ...])
# The generated source defines webots_cloud::web::find_asset for them (src/web/assets.hpp). EXTERNAL files lie outside of ROOT:
# libraries from elsewhere, under a name of ours. Compressed copies are made beside OUTPUT.
set(WEBOTS_CLOUD_EMBED_SCRIPT ${CMAKE_CURRENT_LIST_DIR}/embed_files.cmake)

function(webots_cloud_embed)
    cmake_parse_arguments(EMBED "" "OUTPUT;ROOT" "FILES;EXTERNAL" ${ARGN})
    list(TRANSFORM EMBED_FILES PREPEND ${EMBED_ROOT}/ OUTPUT_VARIABLE paths)
    list(TRANSFORM EMBED_EXTERNAL REPLACE "^.*=" "" OUTPUT_VARIABLE external_paths)
    string(REPLACE ";" "," names "${EMBED_FILES};${EMBED_EXTERNAL}")
    add_custom_command(
        OUTPUT ${EMBED_OUTPUT}
        COMMAND ${CMAKE_COMMAND} -DOUTPUT=${EMBED_OUTPUT} -DROOT=${EMBED_ROOT} -DFILES=${names}
                -P ${WEBOTS_CLOUD_EMBED_SCRIPT}
        DEPENDS ${paths} ${external_paths} ${WEBOTS_CLOUD_EMBED_SCRIPT}
        COMMENT "Embedding the web pages")
    # The compiler does not tell that the assembler reads these files, too.
    set_source_files_properties(${EMBED_OUTPUT} PROPERTIES OBJECT_DEPENDS "${paths};${external_paths}")
endfunction()
