!! How far reduced rotor models are from the unreduced one, as `&reduction compare` asks.
module razy_study_modes_reduction
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_study_modes_rotor, only: mesh_names
   use razy_core_error, only: error_t, raise
   use razy_input_input, only: input_t
   use razy_core_kinds, only: pi, wp
   use razy_study_modes_result, only: modes_result_t, reduction_result_t
   use razy_linalg_generalised, only: eigenpairs_t
   use razy_rotor_reduction_craig_bampton, only: interface_coordinates
   use razy_rotor_whirl_modes, only: natural_modes
   use razy_rotor_reduction_reduced, only: reduced_t
   use razy_rotor_reduction_reduction_error, only: compare_reduction, reduction_error_t
   use razy_scenes_rotor_scene, only: rotor_scene_t
   use razy_scenes_rotor_reduction, only: chosen, reduce_by, reduction_t
   use razy_scenes_rotor_schema, only: method_craig_bampton
   implicit none(type, external)
   private

   public :: compare_reductions

   !> Frequencies at which transfer functions are compared.
   integer, parameter :: points = 100

contains

   !> Compare the kinds of reduction that the input asks for.
   subroutine compare_reductions(content, rotor, input, error)
      type(modes_result_t), intent(inout) :: content
      type(rotor_scene_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(reduction_t), allocatable :: kind(:)
      type(reduction_error_t), allocatable :: known
      real(wp), allocatable :: omega(:)
      character(:), allocatable :: compare
      integer :: i, modes

      compare = input%choice("reduction", 1, "compare")
      if (compare == "none" .or. input%count("gear_mesh") == 0) return
      call input%get("reduction", 1, "compare_modes", modes)
      call find_frequencies(omega, rotor, input, modes, error)
      if (.not. allocated(error)) call list_kinds(kind, rotor, input, compare == "all", error)
      if (allocated(error)) return
      allocate (content%reduction)
      content%mesh = mesh_names(input)
      call begin(content%reduction, size(kind), modes, size(content%mesh), omega)
      do i = 1, size(kind)
         call put(content%reduction, i, kind(i))
         if (allocated(error)) return
      end do

   contains

      subroutine put(table, i, kind)
         type(reduction_result_t), intent(inout) :: table
         integer, intent(in) :: i
         type(reduction_t), intent(in) :: kind

         type(reduced_t) :: reduced
         type(reduction_error_t) :: found
         integer :: m

         call reduce_by(reduced, rotor%model, input, kind, error)
         if (allocated(error)) return
         ! There is none known at first.
         found = compare_reduction(rotor%model, reduced, modes, omega, known)
         if (.not. found%complete) call raise(error, "the comparison with the unreduced model could not be computed")
         if (allocated(error)) return
         if (i == 1) known = found
         m = size(found%frequency)
         table%name(i) = name_of(kind)
         table%coordinates(i) = size(reduced%load)
         table%compliance(:, i) = found%reduced_compliance
         table%frequency(:m, i) = found%nearest/(2*pi)
         table%response(:, :, i) = transpose(found%reduced_response)
         table%error(:, i) = [found%largest_compliance_error(), found%largest_mesh_mode_error(), found%largest_response_error()]
         if (i > 1) return
         table%true_compliance = found%compliance
         table%true_frequency(:m) = found%frequency/(2*pi)
         table%moves(:m) = merge(1, 0, found%moves)
         table%true_response = transpose(found%response)
      end subroutine put

   end subroutine compare_reductions

   subroutine begin(table, kinds, modes, meshes, omega)
      type(reduction_result_t), intent(out) :: table
      integer, intent(in) :: kinds, modes, meshes
      real(wp), intent(in) :: omega(:)

      real(wp) :: nan

      nan = ieee_value(nan, ieee_quiet_nan)
      table%hertz = omega/(2*pi)
      allocate (table%name(kinds), table%coordinates(kinds))
      allocate (table%moves(modes), source=0)
      allocate (table%compliance(meshes, kinds), table%frequency(modes, kinds), table%true_frequency(modes), source=nan)
      allocate (table%response(size(omega), meshes, kinds), source=cmplx(nan, nan, wp))
      allocate (table%error(3, kinds), source=nan)
   end subroutine begin

   !> Frequencies of the transfer functions, rad/s, in equal steps up to the limit.
   subroutine find_frequencies(omega, rotor, input, modes, error)
      real(wp), allocatable, intent(out) :: omega(:)
      type(rotor_scene_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      integer, intent(in) :: modes
      type(error_t), allocatable, intent(out) :: error

      type(eigenpairs_t) :: pairs
      real(wp) :: limit
      integer :: i

      if (input%given("reduction", 1, "compare_limit")) then
         call input%get("reduction", 1, "compare_limit", limit)
      else
         pairs = natural_modes(rotor%model, modes, meshed=.true.)
         limit = sqrt(maxval([0.0_wp, pairs%value]))/(2*pi)
      end if
      if (.not. limit > 0.0_wp) call input%complain(error, "reduction", 1, "compare_limit", &
                                                    "required: the modes compared are rigid")
      ! Between the ends: the last is a natural frequency, where an undamped rotor has no response.
      omega = [(2*pi*limit*(i - 0.5_wp)/points, i=1, points)]
   end subroutine find_frequencies

   !> The reduction of the input first, then the others.
   subroutine list_kinds(kind, rotor, input, all_kinds, error)
      type(reduction_t), allocatable, intent(out) :: kind(:)
      type(rotor_scene_t), intent(in) :: rotor
      type(input_t), intent(in) :: input
      logical, intent(in) :: all_kinds
      type(error_t), allocatable, intent(out) :: error

      type(reduction_t) :: other
      type(reduced_t) :: first
      integer :: i, k, shafts

      shafts = count(rotor%model%rotor%shaft%turns)
      allocate (kind(0))
      call add_pair(chosen(input))
      if (.not. all_kinds) return
      call add_pair(reduction_t())
      if (input%given("reduction", 1, "kept")) then
         do i = 1, 2
            do k = 1, 2
               other%level = merge("a", "b", i == 1)
               other%sorting = merge("absolute", "signed  ", k == 1)
               call add_pair(other)
            end do
         end do
      end if
      call reduce_by(first, rotor%model, input, reduction_t(), error)
      if (allocated(error)) return
      other = reduction_t(method=method_craig_bampton)
      ! As many coordinates as modal synthesis has, as far as interfaces leave room.
      other%modes = spread(max(0, (size(first%load) - count(interface_coordinates(rotor%model)))/shafts), 1, shafts)
      call add_pair(other)

   contains

      !> A kind with the static correction that it has, then with the other; none twice.
      subroutine add_pair(new)
         type(reduction_t), intent(in) :: new

         type(reduction_t) :: variant
         integer :: pass

         variant = new
         do pass = 1, 2
            if (.not. known(variant)) kind = [kind, variant]
            variant%correction = .not. variant%correction
         end do
      end subroutine add_pair

      logical function known(new)
         type(reduction_t), intent(in) :: new

         integer :: j

         known = any([(name_of(kind(j)) == name_of(new), j=1, size(kind))])
      end function known

   end subroutine list_kinds

   !> What a kind is called in tables.
   function name_of(kind) result(name)
      type(reduction_t), intent(in) :: kind
      character(64) :: name

      name = kind%method
      if (name == "modal_synthesis") name = "modal synthesis"
      if (name == method_craig_bampton) name = "Craig-Bampton"
      if (kind%level == "a") name = trim(name)//", level A"
      if (kind%level == "b") name = trim(name)//", level B"
      if (kind%level /= "none") then
         if (kind%sorting == "absolute") name = trim(name)//" by |d|"
         if (kind%sorting == "signed") name = trim(name)//" by signed d"
         if (kind%sorting == "frequency") name = trim(name)//" by frequency"
      end if
      if (kind%correction) name = trim(name)//", static correction"
   end function name_of

end module razy_study_modes_reduction
