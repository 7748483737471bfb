# Writes OUT, a C file that holds every config/KIND/NAME.ini and config/scenes/NAME.field of SOURCE as a string, so that
# the program needs no files beside it. cmake -DSOURCE=… -DOUT=… -P presets.cmake
set(text "/* Made from the settings files under config by cmake/presets.cmake. */\n#include \"config/config.h\"\n#include <string.h>\n\nstatic const struct {\n    const char *kind, *name, *text;\n} presets[] = {\n")
function(append kind files)
    foreach(file ${files})
        get_filename_component(name ${file} NAME_WE)
        file(READ ${file} held)
        string(REPLACE "\\" "\\\\" held "${held}")
        string(REPLACE "\"" "\\\"" held "${held}")
        string(REPLACE "\n" "\\n\"\n     \"" held "${held}")
        string(APPEND text "    {\"${kind}\", \"${name}\",\n     \"${held}\"},\n")
    endforeach()
    set(text "${text}" PARENT_SCOPE)
endfunction()
foreach(kind headsets boards scenes)
    file(GLOB files ${SOURCE}/config/${kind}/*.ini)
    append(${kind} "${files}")
endforeach()
file(GLOB files ${SOURCE}/config/scenes/*.field)
append(fields "${files}")
string(APPEND text "};\nenum { COUNT = sizeof presets / sizeof presets[0] };\n
const char *fv_preset_text(const char *kind, const char *name)
{
    for (int i = 0; i < COUNT; i++)
        if (strcmp(presets[i].kind, kind) == 0 && strcmp(presets[i].name, name) == 0) return presets[i].text;
    return NULL;
}

const char *fv_preset_name(const char *kind, int n)
{
    for (int i = 0; i < COUNT; i++)
        if (strcmp(presets[i].kind, kind) == 0 && n-- == 0) return presets[i].name;
    return NULL;
}
")
file(CONFIGURE OUTPUT ${OUT} CONTENT "${text}" @ONLY)
