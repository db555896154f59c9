!! Writes the heads of the pages in docs/namelist to the standard output: one for each group of each kind of scene, from
!! the schema, after a line `@kind` for each kind.
program write_pages
   use, intrinsic :: iso_fortran_env, only: output_unit
   use razy_input_schema, only: group_spec_t
   use schema_pages, only: group_page
   use razy_scenes_common_schema, only: scene_kinds
   use razy_scenes_case, only: study_schema
   implicit none(type, external)

   type(group_spec_t), allocatable :: schema(:)
   integer :: i, k

   do k = 1, size(scene_kinds)
      write (output_unit, "(a)") "@"//trim(scene_kinds(k))
      schema = study_schema(trim(scene_kinds(k)))
      do i = 1, size(schema)
         write (output_unit, "(a)") group_page(schema(i))
      end do
   end do
end program write_pages
