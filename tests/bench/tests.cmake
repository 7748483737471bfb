fv_test(bench full_ratio rt)
fv_test(bench kms_copy display)
fv_test(bench turn rt)
fv_test(bench light_maps rt)
fv_test(bench peers rt)
fv_test(bench atrous rt)
fv_test(bench budget cli)
fv_test(bench weier2016 cli)
fv_test(bench kim2021 rt)
set_tests_properties(bench_kim2021 PROPERTIES TIMEOUT 3600)
fv_test(bench headline cli)
fv_test(bench headline_pyramid cli)
set_tests_properties(bench_headline PROPERTIES TIMEOUT 3600)
set_tests_properties(bench_budget PROPERTIES TIMEOUT 3600)

# Tracing kernels that never had a feature, for left_out: the same source without its bit. `nothing` has
# them all, `all` has points only. Dozens of kernels, that take minutes to compile under a
# sanitizer, and what they compare is bytes of pictures: not there.
if(NOT FV_SANITIZE)
    set(without
        textures=~FV_SCENE_TEXTURES normal_maps=~FV_SCENE_NORMAL_MAPS alpha=~FV_SCENE_ALPHA
        specular=~FV_SCENE_SPECULAR mirrors=~FV_SCENE_MIRRORS glass=~FV_SCENE_GLASS emission=~FV_SCENE_EMISSIVE
        point_lights=~FV_SCENE_POINT_LIGHTS area_lights=~FV_SCENE_AREA_LIGHTS sun=~FV_SCENE_SUN
        ao=~FV_SCENE_AO
        nothing=~0u all=FV_SCENE_POINT_LIGHTS)
    fv_test(bench left_out rt)
    foreach(isa ${isas})
        foreach(kernel ${without})
            string(REGEX MATCH "^([a-z_]+)=(.*)$" matched ${kernel})
            set(name without_${CMAKE_MATCH_1}_${isa})
            add_library(${name} OBJECT ${CMAKE_SOURCE_DIR}/rt/trace/trace_kernel.c)
            target_compile_options(${name} PRIVATE ${isa_flags_${isa}})
            target_compile_definitions(${name} PRIVATE FV_ISA=${isa} FV_TRACE_SAMPLES=fv_trace_without_${CMAKE_MATCH_1} "FV_FEATURES=${CMAKE_MATCH_2}")
            target_link_libraries(${name} PRIVATE config)
            target_sources(bench_left_out PRIVATE $<TARGET_OBJECTS:${name}>)
        endforeach()
    endforeach()
    add_test(NAME unit_left_out COMMAND bench_left_out short)
    set_tests_properties(unit_left_out PROPERTIES LABELS unit TIMEOUT 300)
endif()
fv_test(bench peres2023 rt)
set_tests_properties(bench_peres2023 PROPERTIES TIMEOUT 3600)
