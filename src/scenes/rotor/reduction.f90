!! The reduction that a rotor scene asks for, and the other ones that it can be compared with.
module razy_scenes_rotor_reduction
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: to_text
   use razy_input_input, only: input_t
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduction_condensation, only: condense
   use razy_rotor_reduction_craig_bampton, only: craig_bampton
   use razy_rotor_reduction_reduced, only: reduced_t
   use razy_rotor_reduction_second_level, only: second_level
   use razy_rotor_reduction_synthesis, only: add_static_correction, modal_synthesis
   use razy_scenes_rotor_schema, only: method_craig_bampton, method_none, sortings
   implicit none(type, external)
   private

   public :: chosen, is_reduced, reduce, reduce_by, reduction_t

   !> Dense matrices of more coordinates than this are refused.
   integer, parameter :: most_dense = 3000

   !> A kind of reduction.
   type :: reduction_t
      character(15) :: method = "modal_synthesis"
      character(4) :: level = "none"
      character(9) :: sorting = "absolute"
      logical :: correction = .false.
      !> Modes of each shaft; those of the input if not allocated.
      integer, allocatable :: modes(:)
   end type reduction_t

contains

   !> Whether the input has a reduction.
   function is_reduced(input)
      type(input_t), intent(in) :: input
      logical :: is_reduced

      is_reduced = input%count("reduction") > 0
      if (is_reduced) is_reduced = input%choice("reduction", 1, "method") /= method_none
   end function is_reduced

   !> The model in the coordinates of `&reduction`; without it in its own.
   subroutine reduce(reduced, model, input, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      integer :: i

      associate (n => model%numbering%n)
         if (is_reduced(input)) then
            ! Comparisons of all kinds have second levels of their own.
            if (input%choice("reduction", 1, "compare") /= "all") call input%refuse_alone(error, "reduction", 1, "kept", "level")
            if (.not. allocated(error)) call input%refuse_alone(error, "reduction", 1, "sorting", "level")
            if (allocated(error)) return
            if (model%have_mass([(i, i=1, n)])) then
               call reduce_by(reduced, model, input, chosen(input), error)
            else
               call input%complain(error, "reduction", 1, "method", "'none': coordinates without mass are condensed, and no others")
            end if
         else if (n > most_dense) then
            call input%complain(error, "reduction", 1, "method", "'modal_synthesis' or 'craig_bampton': the model has "// &
                                to_text(n)//" coordinates, and more than "//to_text(most_dense)//" are not taken unreduced")
         else
            call condense(reduced, model, problem)
            if (allocated(problem)) call input%complain( &
               error, "shaft", findloc([(all(model%rotor%shaft(i)%section%material%density > 0.0_wp), &
                                         i=1, size(model%rotor%shaft))], .false., dim=1), "", problem%message)
         end if
      end associate
   end subroutine reduce

   !> The kind of reduction in the input.
   function chosen(input) result(kind)
      type(input_t), intent(in) :: input
      type(reduction_t) :: kind

      kind%method = input%choice("reduction", 1, "method")
      kind%level = input%choice("reduction", 1, "level")
      kind%sorting = input%choice("reduction", 1, "sorting")
      call input%get("reduction", 1, "static_correction", kind%correction)
   end function chosen

   !> The model reduced in this way, with the numbers of modes of the input. The static correction comes last, so that the
   !> second level does not drop it.
   subroutine reduce_by(reduced, model, input, kind, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      type(input_t), intent(in) :: input
      type(reduction_t), intent(in) :: kind
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      type(reduced_t) :: first
      character(:), allocatable :: caution

      call first_level(reduced, model, input, kind, error)
      if (allocated(error)) return
      if (kind%level /= "none") then
         if (.not. input%given("reduction", 1, "kept")) then
            call input%complain(error, "reduction", 1, "kept", "required: the number of modes kept on the second level")
            return
         end if
         first = reduced
         call second_level(reduced, first, model, input%whole("reduction", 1, "kept"), kind%level == "b", &
                           findloc(sortings, kind%sorting, dim=1), caution, problem)
         if (allocated(problem)) call input%complain(error, "reduction", 1, "kept", problem%message)
      end if
      if (.not. allocated(error) .and. kind%correction) call add_static_correction(reduced, model, error)
      if (allocated(caution)) reduced%caution = caution
   end subroutine reduce_by

   !> Modes of each shaft.
   subroutine first_level(reduced, model, input, kind, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      type(input_t), intent(in) :: input
      type(reduction_t), intent(in) :: kind
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: problem
      integer, allocatable :: coordinates(:), modes(:)
      real(wp) :: limit
      logical :: standard
      integer :: s, shafts

      shafts = size(model%rotor%shaft)
      coordinates = [(model%numbering%first(s + 1) - model%numbering%first(s), s=1, shafts)]
      standard = kind%method == method_craig_bampton
      limit = input%number("reduction", 1, "frequency_limit", otherwise=0.0_wp)
      if (allocated(kind%modes)) then
         modes = kind%modes
      else if (standard .and. limit > 0.0_wp) then
         call input%complain(error, "reduction", 1, "frequency_limit", "left out with method = 'craig_bampton', which has modes")
      else if (input%given("reduction", 1, "modes")) then
         call input%get("reduction", 1, "modes", modes)
         if (size(modes) == 1) modes = merge(min(modes(1), coordinates), modes(1), model%rotor%shaft%rigid .and. .not. standard)
         if (size(modes) /= shafts .or. (standard .and. any(modes /= modes(1)))) then
            call input%complain(error, "reduction", 1, "modes", "one number for all shafts, or with 'modal_synthesis' one "// &
                                "for each of "//to_text(shafts)//", housings last")
         end if
      else if (limit > 0.0_wp .and. .not. standard) then
         modes = coordinates
      else
         call input%complain(error, "reduction", 1, "modes", "required: the number of modes of each shaft"// &
                             merge("                    ", ", or frequency_limit", standard))
      end if
      if (allocated(error)) return
      if (standard) then
         call craig_bampton(reduced, model, modes(1), problem)
      else
         call modal_synthesis(reduced, model, modes, 2*pi*limit, problem)
      end if
      if (allocated(problem)) call input%complain(error, "reduction", 1, "modes", problem%message)
   end subroutine first_level

end module razy_scenes_rotor_reduction
