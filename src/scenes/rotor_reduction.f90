!! The reduction that a rotor scene asks for.
module razy_scenes_rotor_reduction
   use razy_core_error, only: error_t
   use razy_core_input, only: input_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: lower
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduced, only: new_reduced, reduced_t
   use razy_rotor_synthesis, only: add_static_correction, craig_bampton, modal_synthesis, second_level
   use razy_scenes_rotor_schema, only: method_craig_bampton, method_none, sortings
   implicit none(type, external)
   private

   public :: is_reduced, reduce

   !> Dense matrices of more coordinates than this are refused.
   integer, parameter :: most_dense = 3000

contains

   !> Whether the input has a reduction.
   function is_reduced(input)
      type(input_t), intent(in) :: input
      logical :: is_reduced

      character(:), allocatable :: method

      is_reduced = .false.
      if (input%count("reduction") == 0) return
      call input%get("reduction", 1, "method", method)
      is_reduced = lower(method) /= method_none
   end function is_reduced

   !> The model in the coordinates of `&reduction`; without it in its own.
   subroutine reduce(reduced, model, input, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: identity(:, :)
      logical :: correction
      integer :: i, n

      n = model%numbering%n
      if (.not. is_reduced(input)) then
         if (n > most_dense) then
            call input%complain(error, "reduction", 1, "method", "'modal_synthesis' or 'craig_bampton': the model has "// &
                                to_text(n)//" coordinates, and more than "//to_text(most_dense)//" are not taken unreduced")
            return
         end if
         allocate (identity(n, n), source=0.0_wp)
         do i = 1, n
            identity(i, i) = 1.0_wp
         end do
         reduced = new_reduced(model, identity)
         return
      end if
      call first_level(reduced, model, input, error)
      if (allocated(error)) return
      call input%get("reduction", 1, "static_correction", correction)
      if (correction) call add_static_correction(reduced, model, error)
      if (.not. allocated(error)) call take_second_level(reduced, input, error)
   end subroutine reduce

   !> Modes of each shaft.
   subroutine first_level(reduced, model, input, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      character(:), allocatable :: method
      integer, allocatable :: modes(:)
      real(wp) :: limit
      integer :: s, shafts

      shafts = size(model%rotor%shaft)
      call input%get("reduction", 1, "method", method)
      limit = 0.0_wp
      call input%get("reduction", 1, "frequency_limit", limit)
      if (input%given("reduction", 1, "modes")) then
         call input%get("reduction", 1, "modes", modes)
         if (size(modes) == 1) modes = spread(modes(1), 1, shafts)
         if (size(modes) /= shafts .or. (lower(method) == method_craig_bampton .and. any(modes /= modes(1)))) then
            call input%complain(error, "reduction", 1, "modes", "one number for all shafts, or with 'modal_synthesis' one "// &
                                "for each of "//to_text(shafts))
         end if
      else if (limit > 0.0_wp .and. lower(method) /= method_craig_bampton) then
         modes = [(model%numbering%first(s + 1) - model%numbering%first(s), s=1, shafts)]
      else
         call input%complain(error, "reduction", 1, "modes", "required: the number of modes of each shaft"// &
                             merge("                    ", ", or frequency_limit", lower(method) == method_craig_bampton))
      end if
      if (allocated(error)) return
      if (lower(method) == method_craig_bampton) then
         call craig_bampton(reduced, model, modes(1), problem)
      else
         call modal_synthesis(reduced, model, modes, 2*pi*limit, problem)
      end if
      if (allocated(problem)) call input%complain(error, "reduction", 1, "modes", problem%message)
   end subroutine first_level

   !> Modes of the reduced model, if asked for.
   subroutine take_second_level(reduced, input, error)
      type(reduced_t), intent(inout) :: reduced
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      type(reduced_t) :: old
      character(:), allocatable :: level, sorting
      integer :: kept

      call input%get("reduction", 1, "level", level)
      if (lower(level) == "none") return
      if (.not. input%given("reduction", 1, "kept")) then
         call input%complain(error, "reduction", 1, "kept", "required: the number of modes kept on the second level")
         return
      end if
      call input%get("reduction", 1, "kept", kept)
      call input%get("reduction", 1, "sorting", sorting)
      old = reduced
      call second_level(reduced, old, kept, lower(level) == "b", findloc(sortings, lower(sorting), dim=1), problem)
      if (allocated(problem)) call input%complain(error, "reduction", 1, "kept", problem%message)
   end subroutine take_second_level

end module razy_scenes_rotor_reduction
